# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from bench import jobs, samplers
from bench.scene_files import scene_file
from generator import load_tile

SMALL = jobs.Settings(size=(32, 32))


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    for module in (jobs, samplers):
        monkeypatch.setattr(module, "CACHE", tmp_path)
    return tmp_path


def test_joint_tile_is_of_its_dimensions_and_kept(empty_cache, monkeypatch):
    monkeypatch.setattr(samplers, "SIZE", 8)
    first = samplers.joint(("t", "light.u", "light.v"))
    assert load_tile(first.tile).values.shape == (8, 8, 1, 3)
    assert samplers.joint(("t", "light.u", "light.v")) == first


def test_every_sampler_renders_in_one_process_and_has_the_same_mean(empty_cache, monkeypatch):
    scene = scene_file("motion_blur")
    chosen = [samplers.RANDOM, samplers.scanning(("t",)), samplers.SHIPPED_TILE, samplers.OURS]
    wanted = [(sampler.settings(SMALL), range(3)) for sampler in chosen]
    anywhere = jobs.Settings(engine=jobs.TABULATED, size=(32, 32), first_sample=1)
    calls = []
    run = jobs.run_worker
    monkeypatch.setattr(jobs, "run_worker", lambda *order: calls.append(order) or run(*order))
    jobs.render(scene, [*wanted, (anywhere, range(3))])
    means = [np.mean(jobs.images(scene, *each)) for each in (*wanted, (anywhere, range(3)))]
    assert len(calls) == 1
    assert means == pytest.approx([means[0]] * 5, rel=0.02)
