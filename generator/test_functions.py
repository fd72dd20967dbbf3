"""Random integrands for judging a tile: steps, smooth bumps, products of steps.

A pixel of a distribution ray tracer sees some function f of the parameters (Mitchell 1991, equation 2). Edges of
objects, shadows and bokeh make it a step along an unknown direction; soft penumbrae make it smooth; a light seen
through two moving edges makes it a box. `draw` makes families of such functions on the unit cube.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

BUMP_WIDTHS = (0.15, 0.6)
"""Range of the standard deviation of a smooth bump, in units of the cube's side, drawn log-uniformly."""

EXPECTATION_POINTS = 1 << 15
"""Points of the lattice that computes E f. Its error is below 1e-3, that is 1e-6 in squared units, where the best
tiles reach about 1e-4 at sigma = 4."""


@dataclass(frozen=True)
class TestFunctions:
    """A family of functions on the unit cube.

    Attributes
    ----------
    evaluate : callable
        Maps points of shape (N, d) to values of shape (count, N).
    mean, variance : ndarray of float64, shape (count,)
        Expectation and variance of each function for uniform points.
    """

    __test__ = False  # the name is not an invitation to pytest

    evaluate: Callable[[np.ndarray], np.ndarray]
    mean: np.ndarray
    variance: np.ndarray


def _steps(rng, count, d):
    """Half-spaces [(s - c).n > 0], c uniform in the cube, n uniform on the sphere."""
    centre = rng.random((count, d))
    normal = rng.standard_normal((count, d))
    offset = np.einsum("fd,fd->f", centre, normal)
    return lambda points: (normal @ points.T > offset[:, None]).astype(np.float64)


def _bumps(rng, count, d):
    """Gaussian bumps with centre uniform in the cube."""
    centre = rng.random((count, d))
    low, high = np.log(BUMP_WIDTHS)
    width = np.exp(rng.uniform(low, high, count))

    def evaluate(points):
        square = (centre**2).sum(1)[:, None] - 2 * centre @ points.T + (points**2).sum(1)
        return np.exp(-0.5 * square / width[:, None] ** 2)

    return evaluate


def _products(rng, count, d):
    """Boxes: products of one step per axis, each with a random side."""
    centre = rng.random((count, d))
    side = rng.choice((-1.0, 1.0), (count, d))

    def evaluate(points):
        inside = np.ones((count, len(points)), dtype=bool)
        for axis in range(d):
            inside &= side[:, axis, None] * (points[:, axis] - centre[:, axis, None]) > 0
        return inside.astype(np.float64)

    return evaluate


KINDS = {"step": _steps, "bump": _bumps, "product": _products}


def _lattice(count, d):
    """Return `count` evenly spread points of the d-cube (additive recurrence with the generalised golden ratio)."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (d + 1))
    step = ratio ** -np.arange(1, d + 1)
    return (0.5 + np.arange(count)[:, None] * step) % 1.0


def draw(kind, count, d, rng):
    """Draw random test functions.

    Parameters
    ----------
    kind : {'step', 'bump', 'product'}
    count : int
        Number of functions, at least 1.
    d : int
        Number of dimensions of the cube.
    rng : numpy.random.Generator

    Returns
    -------
    TestFunctions

    Raises
    ------
    ValueError
        If `kind` is unknown or `count` is not positive.
    """
    if kind not in KINDS:
        raise ValueError(f"test functions: expected one of {', '.join(KINDS)}, got {kind!r}")
    if count < 1:
        raise ValueError(f"test functions: expected a positive count, got {count}")
    evaluate = KINDS[kind](rng, count, d)
    values = evaluate(_lattice(EXPECTATION_POINTS, d))
    return TestFunctions(evaluate, values.mean(axis=1), values.var(axis=1))
