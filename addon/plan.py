# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample plan: which film pixel each render pixel serves.

Cycles' numbers at a render pixel are known before the render (`addon.cycles_random`), and our camera can point any
render pixel at any film pixel.  `addon.automatic` and `addon.tile_plan` make plans; this module holds what they make.
"""

import collections
import threading
import time
from dataclasses import dataclass, field, replace

import numpy as np

from . import cycles_random, film, openimageio
from .failure import Refused
from .region import bands

# Plans kept for the next frames and renders of this process, 4 bytes a pixel each or, with a tile's lens, 12: those of
# two groups of frames (`automatic.GROUP`).
_REMEMBERED = 8

# Seconds a pixel to make a plan, until this process has made one (`python -m bench times`, two cores).
_PACE = 0.6e-6

# A region of more pixels than this has samples enough to be moved about for every seed and frame: its plan is made
# once.  A smaller one is soon made, and would show the same few samples again and again.
LARGE = 256 * 256

# Samples of a pixel that a plan looks at: what more of them leave is hardly seen, and would take minutes to weigh.
MOST_PLANNED = 64


@dataclass(frozen=True)
class Plan:
    """Film pixel, and lens shift, of every render pixel of a region.

    Attributes
    ----------
    seed : int
        The Cycles seed that the plan was made for.
    width : int
        Of the region, in pixels.
    film : int32 array, shape (pixels,)
        `film[p]` is the film pixel that render pixel p serves, both counted row by row from the region's lower left.
    lens_shift : float32 array, shape (pixels, 2), or None
        What to add, modulo 1, to Cycles' lens numbers at each render pixel.
    errors : dict of str to float
        Mean distance, per dimension, between what a tile wants and what Cycles will draw.
    """

    seed: int
    width: int
    film: np.ndarray
    lens_shift: np.ndarray | None = None
    errors: dict = field(default_factory=dict)

    @classmethod
    def in_place(cls, seed, region):
        """The plan in which each render pixel of a region (Region) serves the film pixel where it is."""
        return cls(seed % 2**31, region.size[0], np.arange(region.pixels, dtype=np.int32))

    @property
    def miss(self):
        """The errors in words, such as "t 0.012, light.u 0.031"; empty if there are none."""
        return ", ".join(f"{name} {error:.3f}" for name, error in self.errors.items())

    def moved(self, right, up):
        """The same plan on a film that is shifted by whole pixels, around the region's edges."""
        row, column = np.divmod(self.film, np.int32(self.width))
        row += np.int32(up)
        row %= np.int32(self.film.size // self.width)
        column += np.int32(right)
        column %= np.int32(self.width)
        row *= np.int32(self.width)
        row += column
        return replace(self, film=row)

    def at_film(self, region):
        """What Cycles draws at each film pixel.

        Parameters
        ----------
        region : addon.region.Region

        Returns
        -------
        ranks : uint32 array, shape (height, width)
            Of `cycles_random.pixel_ranks`.
        lens_shift : dict of str to uint8 array, shape (height, width)
            What our camera adds to the lens numbers, in 256ths; empty if nothing.
        """
        x, y = (np.arange(size) + corner for size, corner in zip(region.size, region.corner, strict=True))
        shape = len(y), len(x)
        ranks = np.empty(self.film.size, np.uint32)
        for band in bands(len(y)):
            served = self.film[band.start * self.width : band.stop * self.width]
            ranks[served] = cycles_random.pixel_ranks(x[None, :], y[band, None], self.seed).ravel()
        shifts = {} if self.lens_shift is None else dict(zip(("lens.u", "lens.v"), self.lens_shift.T, strict=True))
        moved = {name: film.scatter((256.0 * shift).astype(np.uint8), self.film) for name, shift in shifts.items()}
        return ranks.reshape(shape), {name: shift.reshape(shape) for name, shift in moved.items()}

    def write(self, path):
        """Write the image that `camera.osl` reads: film column and row, then the lens shift, as 16-bit integers.

        Raises
        ------
        Refused
            The folder is not writable, the disk is full.
        """

        def entries(pixels):
            row, column = np.divmod(np.maximum(self.film[pixels], 0), np.int32(self.width))
            if self.lens_shift is None:
                return np.column_stack([column, row, np.zeros((row.size, 2), np.int32)])
            # A shift by 1 may come out as 65535 / 65535; modulo 1 that is the same as none.
            return np.column_stack([column, row, np.rint(65535.0 * self.lens_shift[pixels])])

        self._write(path, 4, entries)

    def write_positions(self, path, positions, taken, all_of_them=True):
        """Write an image of where in its film pixel each render pixel's sample lies, and whether it is taken.

        Parameters
        ----------
        path : str
        positions : uint16 array, shape (2, pixels), or None
            Of `reconstruction.positions`, at each render pixel; None leaves them to Cycles.
        taken : bool array, shape (pixels,)
            At each render pixel.
        all_of_them : bool
            Whether the positions are all samples', or only that of the one that Cycles puts into the middle.

        Raises
        ------
        Refused
            The folder is not writable, the disk is full.
        """
        chosen = np.uint16(32768 if positions is None else 65535 if all_of_them else 49152)
        where = np.broadcast_to(np.uint16(0), (2, taken.size)) if positions is None else positions
        self._write(path, 3, lambda pixels: np.column_stack([*where[:, pixels], taken[pixels] * chosen]))

    def _write(self, path, channels, entries):
        """Write an image band by band; `entries` of a slice of pixels are (pixels, channels)."""
        height = self.film.size // self.width
        oiio = openimageio.load()
        spec = oiio.ImageSpec(self.width, height, channels, "uint16")
        spec.attribute("compression", "none")
        output = oiio.ImageOutput.create(path)
        written = bool(output) and output.open(path, spec)
        for band in bands(height):
            part = entries(slice(band.start * self.width, band.stop * self.width)).astype(np.uint16)
            part = part.reshape(-1, self.width, channels)
            written = written and output.write_scanlines(band.start, band.stop, 0, part)
        if not (written and output.close()):
            raise Refused(f"Cannot write the sample plan to {path}: {output.geterror() if output else oiio.geterror()}")


class Memory:
    """The last few plans, by what they were made from.  Several threads may ask.

    Attributes
    ----------
    pace : float
        Seconds that the last plan of a large region took, a pixel.
    """

    def __init__(self):
        self.pace = _PACE
        self._plans = collections.OrderedDict()
        self._lock = threading.Lock()

    def get(self, key, make):
        """The plan remembered under `key`, or else `make()`, which is then remembered."""
        with self._lock:
            if key in self._plans:
                self._plans.move_to_end(key)
                return self._plans[key]
        start = time.perf_counter()
        plan = make()
        pixels = plan.film.size
        with self._lock:
            if pixels > LARGE:
                self.pace = (time.perf_counter() - start) / pixels
            self._plans[key] = plan
            if len(self._plans) > _REMEMBERED:
                self._plans.popitem(last=False)
        return plan

    def latest(self):
        """The plan that was asked for last, or None."""
        with self._lock:
            return next(reversed(self._plans.values()), None)

    def clear(self):
        with self._lock:
            self._plans.clear()


memory = Memory()
