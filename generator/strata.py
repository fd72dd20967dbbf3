"""The stratified tiles among which the spectral optimiser looks for the best one."""

import math

from .dimensions import groups
from .equal_strata import REPORTS, stratify_line, stratify_square
from .owen_nets import OwenNets

RUN = 4
"""Frames whose points form a net in every pixel, counted from the first one. Nets of 16 were tried: the mean over 16
frames is as good without, and single frames get worse (sigma = 1, all dimensions: 0.87 against 0.76). Four frames that
begin elsewhere can be a net only if the strata recur every four frames. That was tried too (32 x 32, 600 steps, mean
over seven subsets, sigma = 0): four such frames have .38 instead of .50 of the error of independent ones, but 16 frames
.70 instead of .22."""


class Strata:
    """Maps arbitrary points to stratified ones near by.

    Parameters
    ----------
    pixels : int
    dims : tuple of str
    samples : int
        Samples of a pixel; with more than one, the layers form an Owen-scrambled net in every pixel.
    frames : int
        Frames; with more than one, each layer is stratified alone, and runs of them are nets as far as that allows.
    rng : numpy.random.Generator

    Raises
    ------
    ValueError
        If `samples` is not a power of two.
    """

    def __init__(self, pixels, dims, samples, frames, rng):
        self.dims = dims
        self.layers_stand_alone = samples == 1
        self.run = math.gcd(frames, RUN) if frames > 1 else samples
        self.nets = OwenNets(pixels * samples * frames // self.run, self.run, dims, rng)

    def nearest(self, points):
        """Return stratified points near to free ones, both of shape (layers, pixels, D)."""
        layers, pixels, d = points.shape
        runs = points.reshape(-1, self.run, pixels, d).transpose(0, 2, 1, 3)
        nets = self.nets.nearest(runs.reshape(-1, self.run, d)).reshape(runs.shape)
        result = nets.transpose(0, 2, 1, 3).reshape(points.shape)
        if self.layers_stand_alone and layers > 1:
            for layer in result:
                for column in range(d):
                    layer[:, column] = stratify_line(layer[:, column])
        return result

    def _pairs(self):
        """Return the columns of each pair of dimensions that `final` puts on a grid."""
        pairs = [list(columns) for columns in groups(self.dims).values() if len(columns) == 2]
        return pairs if self.layers_stand_alone else []

    def final_reports(self, layers):
        """Return how many times `final` reports for so many layers."""
        return layers * len(self._pairs()) * REPORTS

    def final(self, points, report=None):
        """Return the same with pairs stratified too, on a grid in every layer that stands alone.

        The grid is not part of `nearest` because points jump between its rows: descending through it failed. It takes
        its time on large tiles, so `report` is called now and then.
        """
        result = self.nearest(points)
        for layer in result:
            for columns in self._pairs():
                layer[:, columns] = stratify_square(layer[:, columns], report)
        return result
