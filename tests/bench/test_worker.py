# SPDX-License-Identifier: GPL-3.0-or-later
from importlib import import_module

import pytest

from bench import worker
from bench.jobs import FILM_SEED
from bench.scenes import BUILDERS
from demo_blend.primitives import add_camera, add_sphere, empty_scene, material


@pytest.fixture
def scene():
    """A ball ten metres before a camera that looks along y."""
    made = empty_scene()
    add_sphere("Ball", 1.0, material("Grey", (0.5, 0.5, 0.5)))
    add_camera((0, -11, 0), (0, 0, 0), 50)
    made.frame_set(12)
    return made


def _places(scene, *frames):
    found = []
    for frame in frames:
        scene.frame_set(frame)
        found.append(tuple(scene.camera.matrix_world.translation))
    return found


def test_a_camera_that_stands_is_moved_past_what_it_shows(scene):
    worker.move_camera(scene)
    now, then = _places(scene, 12, 14)
    assert now == pytest.approx((0, -11, 0), abs=1e-4)
    assert then == pytest.approx((2 * 10 / 200, -11, 0), abs=1e-2)


def test_a_camera_that_moves_is_left_alone():
    scene = import_module(BUILDERS["sun_sky"]).build()
    before = _places(scene, 1, 24)
    worker.move_camera(scene)
    assert _places(scene, 1, 24) == before


def test_an_image_of_a_film_has_its_frame_and_seed(scene):
    worker.set_seed(scene, 70 * FILM_SEED + 9, film=True)
    assert (scene.frame_current, scene.cycles.seed) == (9, 70)
