"""The tile: a periodic table of ray tracing parameters, one cell a pixel."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from .dimensions import check_dims
from .messages import quoted

FORMAT_VERSION = 1
GENERATOR_VERSION = "1.1.0"

LARGEST_SIDE = 4096
"""Pixels along each side of a tile, at most."""

MOST_SAMPLES = 1024
"""Samples of a pixel, or frames, at most."""

MOST_VALUES = 1 << 24
"""Numbers in a tile, at most: 64 MB, such as 512 x 512 pixels of 16 samples of four dimensions."""

LARGEST_BELOW_ONE = np.float32(1) - np.float32(2**-24)


def as_unit_float32(values):
    """Return `values` in float32 with 1.0, where rounding up from below has made one, taken back into [0, 1)."""
    return np.minimum(np.asarray(values, dtype=np.float32), LARGEST_BELOW_ONE)


def check_size(name, value, minimum=1, maximum=None):
    """Return `value` as an int, or raise a ValueError that names it unless it is an integer within the bounds."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < minimum or (maximum is not None and value > maximum):
        bounds = f"of at least {minimum}" if maximum is None else f"from {minimum} to {maximum}"
        raise ValueError(f"{name}: expected an integer {bounds}, got {quoted(value)}")
    return int(value)


def check_shape(shape, dims):
    """Raise a ValueError unless `shape` is that of a tile of so many dimensions, and not too large."""
    if len(shape) != 4 or shape[0] != shape[1] or shape[3] != dims or not all(shape):
        raise ValueError(f"values: expected shape (T, T, n, {dims}), got {quoted(tuple(shape))}")
    size, _, samples, _ = shape
    if size > LARGEST_SIDE or samples > MOST_SAMPLES or size * size * samples * dims > MOST_VALUES:
        raise ValueError(
            f"values: expected at most {LARGEST_SIDE} pixels a side, {MOST_SAMPLES} samples and {MOST_VALUES} numbers, "
            f"got shape {quoted(tuple(shape))}"
        )


@dataclass(frozen=True, eq=False)
class Tile:
    """A periodic T x T table of sample parameters (the replicated pattern of Mitchell 1991, section 7).

    Attributes
    ----------
    dims : tuple of str
        Names of the D dimensions, out of `generator.dimensions.DIMENSIONS`.
    values : ndarray of float32, shape (T, T, n, D), C order, read-only
        ``values[y, x, k, d]`` is dimension d of sample k of the pixel (x, y) modulo T, in [0, 1). y counts upwards, as
        rows of a Blender image do. The layers k are the samples of a pixel, or, where ``metadata["parameters"]`` has
        ``frames`` greater than 1, the frames of an animation. Film positions are measured from the left and the lower
        edge of the pixel.
    metadata : mapping
        How the tile was made: ``method``, ``parameters``, ``seed``, ``format_version``, ``generator_version``; values
        that JSON can hold. Missing versions are filled in.

    Raises
    ------
    ValueError
        If a name, the shape or a value is not as described, or the tile is too large (`MOST_VALUES` and so on).
    """

    dims: tuple[str, ...]
    values: np.ndarray
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        dims = check_dims(self.dims)
        values = np.asarray(self.values)
        check_shape(values.shape, len(dims))
        if not np.issubdtype(values.dtype, np.floating):
            raise ValueError(f"values: expected floating point numbers, got {quoted(str(values.dtype))}")
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused below
            values = np.array(values, dtype=np.float32, order="C")
        if not np.isfinite(values).all():
            raise ValueError(f"values: expected finite numbers, got {np.sum(~np.isfinite(values))} that are not")
        if values.min() < 0 or values.max() >= 1:
            raise ValueError(f"values: expected numbers in [0, 1), got {values.min():g} to {values.max():g}")
        values.flags.writeable = False
        versions = {"format_version": FORMAT_VERSION, "generator_version": GENERATOR_VERSION}
        object.__setattr__(self, "dims", dims)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "metadata", MappingProxyType(versions | dict(self.metadata)))

    @property
    def size(self):
        """Side T of the tile in pixels."""
        return self.values.shape[0]

    @property
    def samples(self):
        """Number n of layers."""
        return self.values.shape[2]

    def layers(self, first, last):
        """Return the tile of the layers `first` to `last`, counted from 0, the last one included.

        Raises
        ------
        ValueError
            If the tile does not have them.
        """
        if not 0 <= first <= last < self.samples:
            given = quoted((first, last))
            raise ValueError(f"layers: expected two numbers in order from 0 to {self.samples - 1}, got {given}")
        return Tile(self.dims, self.values[:, :, first : last + 1], self.metadata)

    def columns(self, *names):
        """Return the values of some dimensions, in the order asked for.

        Returns
        -------
        ndarray of float32, shape (T, T, n, len(names))

        Raises
        ------
        ValueError
            If the tile has no such dimension.
        """
        for name in names:
            if name not in self.dims:
                raise ValueError(f"columns: expected names out of {', '.join(self.dims)}, got {quoted(name)}")
        return self.values[..., [self.dims.index(name) for name in names]]
