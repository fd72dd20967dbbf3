"""The methods by their names, and the one door through which tiles are made."""

from inspect import signature

import numpy as np

from .cook import cook_pixels
from .dimensions import check_dims
from .film_positions import film_positions
from .jittered import stratified
from .joint_scanning import joint_scanning
from .messages import quoted
from .n_rooks import n_rooks_pixels
from .scanning import scanning
from .spectral import spectral
from .tile import LARGEST_SIDE, MOST_SAMPLES, Tile, as_unit_float32, check_shape, check_size
from .white import white

METHODS = {
    "spectral": spectral,
    "scanning": scanning,
    "joint-scanning": joint_scanning,
    "stratified": stratified,
    "film-positions": film_positions,
    "cook": cook_pixels,
    "n-rooks": n_rooks_pixels,
    "white": white,
}
"""Name to function (size, dims, samples, rng) -> values of shape (size, size, samples, len(dims))."""


LARGEST_SEED = 2**32 - 1


def _parameters(function):
    """Return the names of a method's own parameters, those after the four that all have."""
    return list(signature(function).parameters)[4:]


def make_tile(method, size, dims, seed, samples=1, progress=None, **parameters):
    """Make a tile.

    Parameters
    ----------
    method : str
        A key of `METHODS`.
    size : int
        Side T in pixels, at most `generator.tile.LARGEST_SIDE`.
    dims : sequence of str
        See `generator.dimensions.DIMENSIONS`.
    seed : int
        0 to `LARGEST_SEED`; the same arguments give the same tile.
    samples : int
        Samples n of a pixel, at most `generator.tile.MOST_SAMPLES`; the whole tile has at most
        `generator.tile.MOST_VALUES` numbers.
    progress : callable, optional
        Called as ``progress(done, total)`` by methods that take long.
    **parameters
        Further arguments of the method.

    Returns
    -------
    Tile

    Raises
    ------
    ValueError
        If an argument is not as described.
    """
    if method not in METHODS:
        raise ValueError(f"method: expected one of {', '.join(METHODS)}, got {quoted(method)}")
    dims = check_dims(dims)
    size = check_size("size", size, maximum=LARGEST_SIDE)
    samples = check_size("samples", samples, maximum=MOST_SAMPLES)
    seed = check_size("seed", seed, 0, LARGEST_SEED)
    check_shape((size, size, samples, len(dims)), len(dims))
    function = METHODS[method]
    accepted = _parameters(function)
    for name in parameters:
        if name not in accepted:
            raise ValueError(f"{name}: expected only with other methods, got it with {method}")
    reporting = {"progress": progress} if "progress" in accepted else {}
    values = function(size, dims, samples, np.random.default_rng(seed), **parameters, **reporting)
    metadata = {"method": method, "parameters": {"size": size, "samples": samples, **parameters}, "seed": seed}
    return Tile(dims, as_unit_float32(values), metadata)
