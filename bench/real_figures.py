# SPDX-License-Identifier: GPL-3.0-or-later
"""What renders of a real file tell: errors and costs at the same settings, and the time to equal error."""

import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter

from bench.equal_error import Curve, Estimate, better
from bench.metrics import LUMINANCE, SIGMAS
from bench.real_renders import EVEN, NATIVE, OURS, THRESHOLD, Render, Result

#: Luminance above this counts as this: one firefly would outweigh the rest of the picture.
BRIGHTEST = 4.0

#: Mean squares below this are nothing: what rounding leaves of a picture without noise.
NOTHING = 1e-9

#: Pixels a side of the squares whose errors are compared to tell what of a ratio is chance.
_SQUARE = 16

#: Native Cycles by its better way for the file.
BETTER = "better"


@dataclass(frozen=True)
class Measured:
    """One setting of one renderer: means of errors and medians of costs over seeds and repeats.

    Attributes
    ----------
    wall, processor : float
        Seconds.
    peak : float
        Bytes.
    errors : tuple of float
        Mean square error at each of `SIGMAS`.
    broken : int
        Values that are not finite, in all pictures together.
    squares : ndarray, shape (sigmas, squares)
        Mean square errors in squares of the picture.
    """

    wall: float
    processor: float
    peak: float
    errors: tuple[float, ...]
    broken: int
    squares: np.ndarray = field(compare=False)

    def told(self) -> dict:
        """Return all but the squares, as JSON can hold it."""
        return {name: value for name, value in vars(self).items() if name != "squares"}


#: Renderer, mode and setting to what was measured.
Measurements = dict[tuple[str, str, str], Measured]


def measurements(results: Sequence[tuple[Render, Result]], halves: Sequence[np.ndarray]) -> Measurements:
    """Return what was measured at each setting.

    Parameters
    ----------
    results : sequence of (Render, Result)
        Of one file, references left out.
    halves : sequence of ndarray
        Two independent converged pictures, as `seen`.
    """
    groups: dict[tuple[str, str, str], list] = {}
    for render, result in results:
        groups.setdefault((render.engine, render.mode, render.setting), []).append((render, result))
    found = {}
    for key, group in groups.items():
        pictures = [result.pixels() for render, result in group if not render.repeat]
        if not pictures:  # they failed, though their repeats did not
            continue
        errors = np.mean([error_maps(seen(pixels), halves) for pixels in pictures], axis=0)
        costs = [
            statistics.median(getattr(result, name) for _, result in group) for name in ("wall", "processor", "peak")
        ]
        broken = sum(int(np.count_nonzero(~np.isfinite(pixels))) for pixels in pictures)
        means = tuple(float(np.mean(error)) for error in errors)
        found[key] = Measured(*costs, means, broken, np.array([_squares(error) for error in errors]))
    return found


def seen(pixels: np.ndarray) -> np.ndarray:
    """Return the luminance that errors are measured on: from 0 to `BRIGHTEST`, black where it is not a number.

    Parameters
    ----------
    pixels : ndarray
        Linear RGB, shape (height, width, 3).
    """
    return np.clip(np.nan_to_num(pixels @ LUMINANCE, nan=0.0), 0.0, BRIGHTEST)


def error_maps(picture: np.ndarray, halves: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return each pixel's square error at each of `SIGMAS`, free of the reference's own noise on average.

    The errors against the two halves are multiplied: their noises are independent, so that the product's mean has none.

    Parameters
    ----------
    picture : ndarray
        As `seen`.
    halves : sequence of ndarray
        Two independent converged pictures, as `seen`.
    """
    differences = [picture.astype(np.float64) - half for half in halves]
    maps = []
    for sigma in SIGMAS:
        first, second = (gaussian_filter(each, sigma) if sigma else each for each in differences)
        maps.append(first * second)
    return maps


def _squares(error: np.ndarray) -> np.ndarray:
    """Return the means over squares of a map of errors; what does not fill a square at the far edges is left out."""
    edge = min(_SQUARE, *(side // 2 for side in error.shape))
    height, width = (side // edge for side in error.shape)
    return error[: height * edge, : width * edge].reshape(height, edge, width, edge).mean((1, 3)).ravel()


def noise_of(halves: Sequence[np.ndarray]) -> list[float]:
    """Return the mean square noise of one of a reference's halves, as `seen`, at each of `SIGMAS`."""
    difference = halves[0].astype(np.float64) - halves[1]
    filtered = (gaussian_filter(difference, sigma) if sigma else difference for sigma in SIGMAS)
    return [float(np.mean(each**2)) / 2 for each in filtered]


def ratio(ours: float, theirs: float) -> float | None:
    """Return a ratio of errors, None where native Cycles has no error to speak of and we have none either."""
    if theirs <= NOTHING:
        return None if ours <= NOTHING else float("inf")
    return max(ours, 0.0) / theirs


def spread(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the standard error of a ratio of errors, from the errors in squares of the picture.

    Squares count as independent; how much they differ in what there is to see counts as chance only as far as their
    ratios differ, too.
    """
    mean = theirs.mean()
    if mean <= NOTHING or len(ours) < 2:
        return 0.0
    deviations = ours - ours.mean() / mean * theirs
    return float(deviations.std(ddof=1) / np.sqrt(len(ours)) / mean)


def curves(found: Measurements, engine: str, mode: str, sigma: int) -> dict[str, Curve]:
    """Return a renderer's error over processor time, by even samples and by noise thresholds.

    Parameters
    ----------
    found : Measurements
    engine, mode : str
    sigma : int
        Index in `SIGMAS`.
    """
    made = {}
    for rule in (EVEN, THRESHOLD):
        points = [
            (each.processor, each.errors[sigma])
            for (of, in_mode, setting), each in found.items()
            if of == engine and in_mode == mode and setting.startswith(rule)
        ]
        if points:
            made[rule] = Curve(*zip(*points, strict=True))
    return made


def file_figures(found: Measurements, pixels: int, reference_noise: Sequence[float]) -> dict:
    """Return all figures of a file.

    Parameters
    ----------
    found : Measurements
    pixels : int
        Of its picture.
    reference_noise : sequence of float
        As `noise_of`.

    Returns
    -------
    dict
        ``pixels`` and ``reference_noise`` as given;
        ``measured``: renderer -> mode -> setting -> `Measured`. And of ours over native Cycles':
        ``same_settings``: mode -> setting -> ``errors`` and their standard errors, ``spreads`` (at each of
        `SIGMAS`), ``processor``, ``wall``, ``bytes_per_pixel`` (a difference);
        ``time_to_error``: mode -> setting of native -> for each of `SIGMAS`: by which of native's ways (`EVEN`,
        `THRESHOLD`, `BETTER`) -> the processor time of our better way to the error that native Cycles leaves at that
        setting, over native's time, with ``value``, ``beyond`` and ``way``;
        ``equal_time``: mode -> our setting -> for each of `SIGMAS`: our error over native's in the same processor time,
        by its better way.
        Empty where ours was not measured. A ratio of errors is None where there is no error to speak of.
    """
    figures = {"pixels": pixels, "reference_noise": list(reference_noise)}
    figures |= {"measured": {}, "same_settings": {}, "time_to_error": {}, "equal_time": {}}
    for (engine, mode, setting), each in found.items():
        figures["measured"].setdefault(engine, {}).setdefault(mode, {})[setting] = each.told()
        if engine != OURS or (NATIVE, mode, setting) not in found:
            continue
        native = found[NATIVE, mode, setting]
        figures["same_settings"].setdefault(mode, {})[setting] = {
            "errors": [ratio(*pair) for pair in zip(each.errors, native.errors, strict=True)],
            "spreads": [spread(*pair) for pair in zip(each.squares, native.squares, strict=True)],
            "processor": each.processor / native.processor,
            "wall": each.wall / native.wall,
            "bytes_per_pixel": (each.peak - native.peak) / pixels,
        }
        of_sigmas = range(len(SIGMAS))
        figures["equal_time"].setdefault(mode, {})[setting] = [_at_equal_time(found, each, mode, s) for s in of_sigmas]
        reached = [_times_to(found, native.errors[s], mode, s) for s in of_sigmas]
        figures["time_to_error"].setdefault(mode, {})[setting] = reached
    return figures


def _at_equal_time(found: Measurements, ours: Measured, mode: str, sigma: int) -> dict | None:
    """Return our error over the least that native Cycles leaves in the same time."""
    left = {way: curve.error_at(ours.processor) for way, curve in curves(found, NATIVE, mode, sigma).items()}
    way, native = better(left)
    if np.isinf(native.value):  # quicker than all that native Cycles was asked for: compared with its quickest
        quickest = [curve.points[0] for curve in curves(found, NATIVE, mode, sigma).values() if curve.points]
        native = Estimate(min(quickest)[1], True) if quickest else Estimate(0.0)
    value = ratio(ours.errors[sigma], native.value)
    return None if value is None else {"value": value, "beyond": native.beyond, "way": way}


def _times_to(found: Measurements, error: float, mode: str, sigma: int) -> dict | None:
    """Return the time of our better way to an error over the time of each of native's ways, and of its better one."""
    if error <= NOTHING:
        return None
    times = {}
    for engine in (NATIVE, OURS):
        times[engine] = {way: curve.time_to(error) for way, curve in curves(found, engine, mode, sigma).items()}
    _, ours = better(times[OURS])
    best_way, _ = better(times[NATIVE])
    ways = {way: (way, native) for way, native in times[NATIVE].items()}
    ways[BETTER] = (best_way, times[NATIVE][best_way])
    # Where native Cycles does not come to the error in reasonable time, there is nothing to compare with.
    reachable = {name: (way, native) for name, (way, native) in ways.items() if np.isfinite(native.value)}
    return {name: asdict(ours.over(native)) | {"way": way} for name, (way, native) in reachable.items()}
