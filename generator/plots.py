"""Pictures of a tile. Needs matplotlib, which is imported when a picture is asked for."""

import zlib
from importlib import import_module
from pathlib import Path

import numpy as np

from .atomic_file import check_writable, written_whole
from .dimensions import groups
from .periodogram import error_periodogram
from .step_test import error_images
from .test_functions import draw

_DPI = 110
_STEPS = 64
_BINS = 32

LARGEST = 512
"""Side of a tile that is drawn, at most; with several samples, the same number of values."""


def _figure(rows, columns, side=3.0):
    try:
        figures = import_module("matplotlib.figure")
    except ImportError:
        raise ValueError("plot: needs matplotlib, which is not installed") from None
    figure = figures.Figure(figsize=(side * columns, side * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def values_figure(tile):
    """Return the first sample's values as images, one a dimension; y upwards."""
    figure, axes = _figure(1, len(tile.dims))
    for axis, dim in zip(axes[0], tile.dims, strict=True):
        axis.imshow(tile.columns(dim)[:, :, 0, 0], origin="lower", cmap="gray", vmin=0, vmax=1)
        axis.set(title=dim, xticks=[], yticks=[])
    return figure


def spectra_figure(tile):
    """Return, for each group and for all together, the spectrum that the step test filters.

    Above, the power of the errors of `_STEPS` random steps, zero frequency in the middle; dark is little power. Below,
    its radial mean (white noise is the line at 1) and its anisotropy.
    """
    subsets = dict(groups(tile.dims))
    if len(subsets) > 1:
        subsets["all"] = tuple(range(len(tile.dims)))
    figure, axes = _figure(3, len(subsets))
    for column, (label, columns) in enumerate(subsets.items()):
        steps = draw("step", _STEPS, len(columns), np.random.default_rng(0))
        errors = error_images(steps, tile.values[..., list(columns)])
        spectrum = error_periodogram(errors / np.sqrt(steps.variance.mean() / tile.samples))
        image, power, anisotropy = axes[:, column]
        image.imshow(spectrum.power, origin="lower", cmap="gray", vmin=0, vmax=2)
        image.set(title=label, xticks=[], yticks=[])
        power.plot(spectrum.radius, spectrum.radial_mean, color="black")
        power.axhline(1, color="gray", linewidth=0.8)
        power.set(ylim=(0, 2))
        anisotropy.plot(spectrum.radius, spectrum.anisotropy, color="black")
        anisotropy.axhline(0, color="gray", linewidth=0.8)
        anisotropy.set(ylim=(-25, 10), xlabel="cycles a tile")
    axes[1, 0].set_ylabel("power, white noise = 1")
    axes[2, 0].set_ylabel("anisotropy, dB")
    return figure


def marginals_figure(tile):
    """Return a matrix of scatter plots of all pairs of dimensions, with histograms on its diagonal; first samples."""
    count = len(tile.dims)
    points = tile.values[:, :, 0].reshape(-1, count)
    figure, axes = _figure(count, count, side=max(1.8, 4 / count))
    for (row, column), axis in np.ndenumerate(axes):
        if row == column:
            axis.hist(points[:, row], bins=_BINS, range=(0, 1), color="gray")
            axis.set(ylim=(0, 2 * len(points) / _BINS))
        else:
            axis.plot(points[:, column], points[:, row], ",", color="black")
            axis.set(ylim=(0, 1))
        axis.set(xlim=(0, 1), xticks=[], yticks=[])
        if row == count - 1:
            axis.set_xlabel(tile.dims[column])
        if column == 0:
            axis.set_ylabel(tile.dims[row] if count > 1 else "pixels")
    return figure


def neighbourhood_figure(tile):
    """Return the values found in discs of the image, as in figure 6 of the paper.

    For each dimension, tick marks of all samples within 1.5 and within 2.5 pixels of the tile's middle: Poisson-rod
    distributions, if the tile is good.
    """
    size = tile.size
    pixel = np.arange(size) - size // 2
    distance = np.hypot(pixel[:, None], pixel)
    figure, axes = _figure(len(tile.dims), 2, side=1.6)
    figure.set_size_inches(9, 1.1 * len(tile.dims) + 0.5)
    for (row, column), axis in np.ndenumerate(axes):
        radius = (1.5, 2.5)[column]
        axis.vlines(tile.columns(tile.dims[row])[distance <= radius].ravel(), 0, 1, color="black")
        axis.set(xlim=(0, 1), yticks=[], ylabel=tile.dims[row] if column == 0 else "")
        if row == 0:
            axis.set_title(f"within {radius:g} pixels")
    return figure


FIGURES = {
    "values": values_figure,
    "spectra": spectra_figure,
    "marginals": marginals_figure,
    "neighbourhood": neighbourhood_figure,
}


def _check_png(path):
    """Raise a ValueError unless a file is a PNG image to its end."""
    data = path.read_bytes()
    at, kind = 8, b""
    while data[:8] == b"\x89PNG\r\n\x1a\n" and kind != b"IEND" and at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4])
        kind = data[at + 4 : at + 8]
        if zlib.crc32(data[at + 4 : at + 8 + length]).to_bytes(4) != data[at + 8 + length : at + 12 + length]:
            break
        at += 12 + length
    if kind != b"IEND" or at != len(data):
        raise ValueError("expected a PNG image, got a damaged one")


def save_figures(tile, stem, progress=None):
    """Write all figures as PNG files.

    Parameters
    ----------
    tile : Tile
        At most `LARGEST` pixels a side and as many values a dimension.
    stem : str or Path
        ``out/tile`` gives ``out/tile-values.png`` and so on.
    progress : callable, optional
        Called as ``progress(done, total)`` after each figure.

    Returns
    -------
    list of Path

    Raises
    ------
    ValueError
        If the tile is too large, or matplotlib is missing.
    OSError
        If a file cannot be written.
    """
    if tile.size**2 * tile.samples > LARGEST**2:
        raise ValueError(f"plot: expected at most {LARGEST**2} pixels times samples, got {tile.size**2 * tile.samples}")
    paths = [Path(f"{stem}-{name}.png") for name in FIGURES]
    for path in paths:
        check_writable(path)
    for index, (path, figure) in enumerate(zip(paths, FIGURES.values(), strict=True)):
        drawn = figure(tile)
        with written_whole(path, _check_png) as temporary:
            drawn.savefig(temporary, dpi=_DPI)
        if progress:
            progress(index + 1, len(paths))
    return paths
