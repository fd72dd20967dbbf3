"""The tile: a periodic table of ray tracing parameters, one cell a pixel."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from .dimensions import check_dims

FORMAT_VERSION = 1
GENERATOR_VERSION = "1.1.0"

LARGEST_BELOW_ONE = np.float32(1) - np.float32(2**-24)


def as_unit_float32(values):
    """Return `values` in float32 with 1.0, where rounding up from below has made one, taken back into [0, 1)."""
    return np.minimum(np.asarray(values, dtype=np.float32), LARGEST_BELOW_ONE)


def check_size(name, value, minimum=1):
    """Return `value` as an int, or raise a ValueError that names it if it is not an integer of at least `minimum`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < minimum:
        raise ValueError(f"{name}: expected an integer of at least {minimum}, got {value!r}")
    return int(value)


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
        If a name, the shape or a value is not as described.
    """

    dims: tuple[str, ...]
    values: np.ndarray
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        dims = check_dims(self.dims)
        values = np.asarray(self.values)
        if values.ndim != 4 or values.shape[0] != values.shape[1] or values.shape[3] != len(dims) or not values.size:
            raise ValueError(f"values: expected shape (T, T, n, {len(dims)}), got {values.shape}")
        if not np.issubdtype(values.dtype, np.floating):
            raise ValueError(f"values: expected floating point numbers, got {values.dtype}")
        values = np.array(values, dtype=np.float32, order="C")
        if not np.isfinite(values).all():
            raise ValueError(f"values: expected finite numbers, got {np.sum(~np.isfinite(values))} that are not")
        if values.min() < 0 or values.max() >= 1:
            raise ValueError(f"values: expected numbers in [0, 1), got {values.min()} to {values.max()}")
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
            raise ValueError(f"layers: expected two numbers in order from 0 to {self.samples - 1}, got {first}, {last}")
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
                raise ValueError(f"columns: expected names out of {', '.join(self.dims)}, got {name!r}")
        return self.values[..., [self.dims.index(name) for name in names]]
