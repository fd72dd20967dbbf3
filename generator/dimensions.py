"""Names of a tile's dimensions, and which of them belong together.

A dimension is one random number of a distribution ray tracer (Mitchell 1991, section 1): time, a point of the lens, a
point of a light, and so on. Two numbers that choose one point of a surface form a *group*; what the paper calls a
marginal distribution (section 8) is the distribution of one group's values.
"""

from itertools import combinations

from .messages import quoted

DIMENSIONS = (
    "t",
    "lens.u",
    "lens.v",
    "light.u",
    "light.v",
    "film.x",
    "film.y",
    "light.pick",
    "bsdf.u",
    "bsdf.v",
)
"""Every name a tile may use; see `check_dims`."""


def group_name(dim):
    """Return the name of the group that `dim` belongs to: ``lens`` for ``lens.u``, ``light.pick`` for itself."""
    stem, _, suffix = dim.partition(".")
    return stem if suffix in ("u", "v", "x", "y") else dim


def check_dims(dims):
    """Return `dims` as a tuple after checking it.

    Parameters
    ----------
    dims : iterable of str
        Names out of `DIMENSIONS`, each at most once, in any order.

    Raises
    ------
    ValueError
        If there is no name, a name is unknown, or a name comes twice.
    """
    if isinstance(dims, str):
        raise ValueError(f"dims: expected a sequence of names, got the string {quoted(dims)}")
    dims = tuple(dims)
    if not dims:
        raise ValueError(f"dims: expected at least one of {', '.join(DIMENSIONS)}, got none")
    for dim in dims:
        if dim not in DIMENSIONS:
            raise ValueError(f"dims: expected names out of {', '.join(DIMENSIONS)}, got {quoted(dim)}")
    if len(set(dims)) != len(dims):
        raise ValueError(f"dims: expected each name at most once, got {quoted(', '.join(dims))}")
    return dims


def groups(dims):
    """Split `dims` into groups of columns that belong together.

    Returns
    -------
    dict of str to tuple of int
        Group name to the positions of its dimensions in `dims`, in the order of `dims`.
    """
    result = {}
    for column, dim in enumerate(check_dims(dims)):
        result.setdefault(group_name(dim), []).append(column)
    return {name: tuple(columns) for name, columns in result.items()}


def marginal_subsets(dims):
    """List the marginal distributions that a good tile keeps an eye on (Mitchell 1991, section 8).

    Every group alone, every pair of groups, and all dimensions together; for time, lens and light these are the seven
    columns of the step test's table.

    Returns
    -------
    dict of str to tuple of int
        Label such as ``t+light`` to positions in `dims`. The last one, all dimensions, is labelled ``all`` when there
        are more than two groups.
    """
    by_name = groups(dims)
    result = dict(by_name)
    for pair in combinations(by_name, 2):
        result["+".join(pair)] = by_name[pair[0]] + by_name[pair[1]]
    if len(by_name) > 2:
        result["all"] = tuple(range(len(tuple(dims))))
    return result
