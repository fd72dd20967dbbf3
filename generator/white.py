"""Uniform random values: what the designs are compared with (Mitchell 1991, section 2)."""


def white(size, dims, samples, rng):
    """Return independent uniform values.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    dims : tuple of str
    samples : int
        Samples n of a pixel.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float64, shape (size, size, samples, len(dims)), in [0, 1)
    """
    return rng.random((size, size, samples, len(dims)))
