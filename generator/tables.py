"""Tables for the command line: the analysis of one tile, the step test of one or several."""

import numpy as np

from .dimensions import marginal_subsets
from .messages import one_line
from .periodogram import cylinder_power
from .progress import part_of
from .statistics import correlations, summary
from .step_test import relative_error, step_test


def step_test_lines(tile, sigmas, functions, seed, kind, progress=None):
    """Return the step test of a tile as lines of text; 1 is white noise, lower is better."""
    table = step_test(tile, sigmas, functions, seed, kind, progress)
    width = max(map(len, table))
    lines = ["  ".join([" " * width, *(f"sigma {sigma:g}" for sigma in sigmas)])]
    for label, errors in table.items():
        lines.append("  ".join([f"{label:{width}}", *(f"{error:7.3f}" for error in errors)]))
    return lines


def comparison_lines(tiles, sigmas, functions, seed, kind, progress=None):
    """Return the step tests of several tiles side by side as a Markdown table; the lowest errors are bold.

    Parameters
    ----------
    tiles : dict of str to Tile
        Heading to tile; only the dimensions that all of them have are compared.
    sigmas, functions, seed, kind, progress
        As in `generator.step_test.relative_error`.

    Raises
    ------
    ValueError
        If the tiles have no dimension in common.
    """
    first = next(iter(tiles.values()))
    dims = tuple(dim for dim in first.dims if all(dim in tile.dims for tile in tiles.values()))
    if not dims:
        raise ValueError("compare: expected tiles with a dimension in common, got none")
    scales = " / ".join(f"{sigma:g}" for sigma in sigmas)
    lines = [
        f"Step test: mean square error of {functions} functions ({kind}, seed {seed}) after Gaussians of {scales} "
        "pixels; white noise is 1, the lowest error is bold.",
        "",
        f"| sigma {scales} | " + " | ".join(one_line(name, 60).replace("|", "\\|") for name in tiles) + " |",
        "|---" * (len(tiles) + 1) + "|",
    ]
    subsets = marginal_subsets(dims)
    for row, (label, columns) in enumerate(subsets.items()):
        names = [dims[column] for column in columns]
        errors = []
        for index, tile in enumerate(tiles.values()):
            report = part_of(progress, row * len(tiles) + index, len(subsets) * len(tiles))
            errors.append(relative_error(tile.columns(*names), sigmas, functions, seed, kind, report))
        lowest = np.min(errors, axis=0)
        marks = np.where(errors == lowest, "**", "")
        cells = [
            " ".join(f"{mark}{error:.3f}{mark}" for error, mark in zip(*both, strict=True))
            for both in zip(errors, marks, strict=True)
        ]
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return lines


def analysis_lines(tile):
    """Return statistics of a tile's values, correlations, and the power in the cylinders of the paper's figure 5."""
    lines = []
    for name, row in summary(tile):
        lines.append(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()))
    if len(tile.dims) > 1:
        lines += ["", "correlation  " + "  ".join(f"{dim:>10}" for dim in tile.dims)]
        for dim, row in zip(tile.dims, correlations(tile.values), strict=True):
            lines.append(f"{dim:11}  " + "  ".join(f"{value:10.4f}" for value in row))
    if "t" in tile.dims:
        limits = (tile.size / 8, tile.size / 4)
        power = cylinder_power(tile.columns("t")[..., 0], band_limits=limits)
        lines += ["", "power inside a cylinder of spatial frequencies, by temporal frequency; 1 is white noise"]
        lines.append("cycles a tile  " + "  ".join(f"{k + 1:6d}" for k in range(power.shape[1])))
        for limit, row in zip(limits, power, strict=True):
            lines.append(f"up to {limit:7g}  " + "  ".join(f"{value:6.3f}" for value in row))
    return lines
