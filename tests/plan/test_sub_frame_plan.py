# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of Sub-Frames: every sample of every pixel once, at moments that share the shutter evenly."""

import itertools

import numpy as np
import pytest

from addon.plan import sub_frame_plan

CASES = [(1, 16), (2, 16), (3, 32), (4, 8), (8, 8), (16, 16), (17, 16), (100, 32), (1, 256)]


@pytest.mark.parametrize(("samples", "moments"), CASES)
def test_each_sample_once(samples, moments):
    plan = sub_frame_plan.make(samples, moments, range(samples), 3)
    taken = [
        (shot.cell, shot.first + step)
        for shot in itertools.chain(*plan.groups)
        for step in range(shot.count)
    ]  # fmt: skip
    assert len(taken) == len(set(taken)) == plan.side**2 * samples == plan.length
    assert {first for _, first in taken} == set(range(plan.length))
    assert plan.side == 1 or plan.side**2 // 4 * samples < moments
    assert len({shot.opening for group in plan.groups for shot in group}) == moments


@pytest.mark.parametrize(("samples", "moments"), CASES)
def test_moments_share_the_shutter(samples, moments):
    """Each counts as its samples do, and those of a group give all pixels equally many."""
    plan = sub_frame_plan.make(samples, moments, range(samples), 3)
    shots = list(itertools.chain(*plan.groups))
    weights = {}
    for shot in shots:
        weights[shot.opening] = weights.get(shot.opening, 0) + shot.count / plan.length
    if plan.side == 1 or plan.length % moments == 0:
        for (start, end), weight in weights.items():
            assert weight == pytest.approx(end - start)
    ends = sorted(weights)
    assert ends[0][0] == 0 and ends[-1][1] == 1
    assert all(a[1] == pytest.approx(b[0]) for a, b in itertools.pairwise(ends))
    for group in plan.groups:
        assert len({shot.cell for shot in group}) == plan.side**2
        assert len({shot.count for shot in group}) == 1
        assert [shot.opening for shot in group] == sorted(shot.opening for shot in group)


def test_parts_make_the_whole():
    whole = sub_frame_plan.make(16, 8, range(16), 0)
    parts = [sub_frame_plan.make(16, 8, part, 0) for part in (range(5), range(5, 16))]

    def samples(plan):
        shots = itertools.chain(*plan.groups)
        return {(shot.opening, shot.first + step) for shot in shots for step in range(shot.count)}

    assert samples(parts[0]) | samples(parts[1]) == samples(whole)
    assert not samples(parts[0]) & samples(parts[1])


def test_neighbours_are_seen_at_different_times():
    """In each square of 2 x 2 pixels each quarter of the shutter."""
    plan = sub_frame_plan.make(1, 64, range(1), 5)
    times = np.zeros((plan.side, plan.side))
    for shot in itertools.chain(*plan.groups):
        times[shot.cell] = shot.opening[0]
    for down, right in itertools.product(range(plan.side), repeat=2):
        square = np.roll(times, (-down, -right), axis=(0, 1))[:2, :2]
        assert sorted((4 * square).astype(int).ravel()) == [0, 1, 2, 3]
