# SPDX-License-Identifier: GPL-3.0-or-later
import matplotlib.pyplot as plt
import numpy as np
import pytest

from bench import jobs
from bench.reference import reference_settings
from bench.scene_files import SceneFile, scene_file

SMALL = jobs.Settings(size=(24, 16))


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "CACHE", tmp_path)
    return tmp_path


def test_images_of_two_seeds_differ_and_are_kept(empty_cache):
    scene = scene_file("wheels")
    first, second = jobs.images(scene, SMALL, [1, 2])
    assert first.shape == (16, 24, 3)
    assert first.dtype == np.float32
    assert not np.array_equal(first, second)
    assert jobs.is_cached(scene, SMALL, 2)
    assert not jobs.is_cached(scene, SMALL, 3)
    assert plt.imread(jobs.picture(scene, SMALL, 2)).shape[:2] == (16, 24)
    assert sorted(path.suffix for path in empty_cache.rglob("*") if path.is_file()) == [".npy", ".npy", ".png", ".png"]


def test_seed_means_the_same_in_any_process(empty_cache):
    scene = scene_file("wheels")
    together = jobs.images(scene, SMALL, [1, 2])
    for path in empty_cache.rglob("*seed_2.npy"):
        path.unlink()
    (alone,) = jobs.images(scene, SMALL, [2])
    assert np.array_equal(alone, together[1])


def test_failure_shows_what_the_process_said(empty_cache, tmp_path):
    broken = tmp_path / "broken.blend"
    broken.write_text("no scene")
    with pytest.raises(jobs.RenderFailed, match=r"broken with AUTOMATIC ended with code 1"):
        jobs.images(SceneFile("broken", broken, "0"), SMALL, [0])


def test_a_reference_shows_what_is_measured():
    measured = jobs.Settings(engine=jobs.TILES, samples=2, bounces=0, still=True, gaussian=0.5, method="IN_PLACE")
    truth = reference_settings(measured, 64)
    assert truth == jobs.Settings(samples=64, bounces=0, still=True, gaussian=0.5)
