# SPDX-License-Identifier: GPL-3.0-or-later
"""The house: which wing of the add-on imports which, read from its files, and a picture of that.

`WINGS` is the rule: each imports only what stands below it.  `tests/test_house.py` holds the tree to it.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from generator.atomic_file import written_whole

ADDON = Path(__file__).parents[1] / "addon"

#: From top to bottom, with what each is for.  The entrance is the modules that stand in `addon` itself.
WINGS = {
    "interface": "what a person touches",
    "entrance": "the switch and its settings",
    "drivers": "how Cycles is called",
    "farm": "layers of a frame, and their merge",
    "picture": "what is done to pixels",
    "plan": "which samples are asked for",
    "cycles": "what is known of Cycles",
    "blender": "what is needed of Blender",
}


@dataclass(frozen=True)
class Arrow:
    """One import: module and wing that import, and what is imported."""

    module: str
    wing: str
    imported: str
    imported_wing: str

    @property
    def runs_up(self) -> bool:
        """Whether it breaks the rule."""
        order = list(WINGS)
        return order.index(self.wing) > order.index(self.imported_wing)


def modules(addon: Path = ADDON) -> dict[str, list[str]]:
    """Return the names of the modules of each wing, as ``cycles.passes``; the add-on's own door is left out."""
    found = {wing: [] for wing in WINGS}
    for path in sorted(addon.rglob("*.py")):
        name = _name(path, addon)
        if name and path.name != "__init__.py" and "preset_files" not in path.parts:
            found[_wing(name)].append(name)
    return found


def arrows(addon: Path = ADDON) -> list[Arrow]:
    """Return all imports between modules of the add-on, those inside functions too.

    Raises
    ------
    KeyError
        If a folder is no wing.
    """
    names = {_name(path, addon) for path in addon.rglob("*.py")}
    found = []
    for path in sorted(addon.rglob("*.py")):
        importer = _name(path, addon)
        if not importer:
            continue  # the door opens everything
        package = importer if path.name == "__init__.py" else importer.rpartition(".")[0]
        for imported in _relative_imports(path, package, names):
            if imported and imported != importer:
                found.append(Arrow(importer, _wing(importer), imported, _wing(imported)))
    return found


def _relative_imports(path: Path, package: str, names: set[str]) -> Iterator[str]:
    """Yield the modules that a file imports from the add-on."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not (isinstance(node, ast.ImportFrom) and node.level):
            continue
        parts = package.split(".") if package else []
        base = parts[: len(parts) - (node.level - 1)] if node.level > 1 else parts
        if node.level - 1 > len(parts):
            continue  # leaves the add-on, for the generator
        base = ".".join([*base, *([node.module] if node.module else [])])
        for alias in node.names:
            longer = f"{base}.{alias.name}" if base else alias.name
            yield longer if longer in names else base


def _name(path: Path, addon: Path) -> str:
    parts = list(path.relative_to(addon).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _wing(name: str) -> str:
    first, _, rest = name.partition(".")
    wing = first if rest or (ADDON / first).is_dir() else "entrance"
    if wing not in WINGS:
        raise KeyError(f"{name} is in no wing")
    return wing


# The picture

_COLOURS = dict(zip(WINGS, plt.get_cmap("tab10").colors, strict=False))
_WIDTH, _HEIGHT, _GAP, _LANE = 6.6, 0.92, 0.26, 0.34


def draw(path: Path) -> str:
    """Draw the wings as rooms on top of each other, with the imports between them, and return what was drawn."""
    rooms = modules()
    counts = Counter((arrow.wing, arrow.imported_wing) for arrow in arrows() if arrow.wing != arrow.imported_wing)
    lanes = _lanes(counts)
    width = _WIDTH + _LANE * (1 + max(lanes.values(), default=0)) + 0.4
    height = len(WINGS) * (_HEIGHT + _GAP)
    figure, axes = plt.subplots(figsize=(width, height), dpi=150)
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    for wing, inside in rooms.items():
        _draw_room(axes, wing, inside)
    for (wing, below), count in counts.items():
        _draw_arrow(axes, wing, below, count, lanes)
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.01, top=0.99)
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as temporary:
        figure.savefig(temporary)
    plt.close(figure)
    return f"{path}: {sum(map(len, rooms.values()))} modules, {sum(counts.values())} imports between wings"


def _middle(wing: str) -> float:
    return (len(WINGS) - list(WINGS).index(wing) - 0.5) * (_HEIGHT + _GAP)


def _draw_room(axes: Axes, wing: str, inside: list[str]) -> None:
    middle, colour = _middle(wing), _COLOURS[wing]
    bottom = middle - _HEIGHT / 2
    shape = FancyBboxPatch(
        (0.1, bottom), _WIDTH - 0.2, _HEIGHT, boxstyle="round,pad=0,rounding_size=0.08",
        facecolor=(*colour, 0.12), edgecolor=colour, linewidth=1.2,
    )  # fmt: skip
    axes.add_patch(shape)
    axes.text(0.22, middle + 0.27, wing, weight="bold", fontsize=11, va="center", color=colour)
    axes.text(_WIDTH - 0.22, middle + 0.27, WINGS[wing], fontsize=8.5, va="center", ha="right", style="italic")
    labels = [name.rpartition(".")[2] for name in inside]
    for row, line in enumerate(_lines(labels, 104)):
        axes.text(0.22, middle + 0.02 - 0.18 * row, line, fontsize=7.5, va="center")


def _lines(words: list[str], length: int) -> list[str]:
    lines = [""]
    for word in words:
        if len(lines[-1]) + len(word) > length:
            lines.append("")
        lines[-1] += f"   {word}" if lines[-1] else word
    return lines


def _draw_arrow(axes: Axes, wing: str, below: str, count: int, lanes: dict) -> None:
    """Draw a line out of a room, down its lane and into another room; the number of imports stands where it leaves."""
    leaving = sorted((pair for pair in lanes if pair[0] == wing), key=lanes.get, reverse=True)
    coming = sorted((pair for pair in lanes if pair[1] == below), key=lanes.get)
    # Arrows come in through a room's upper half and leave by its lower half; those of outer lanes go around the others.
    start = _middle(wing) - _spread(leaving.index((wing, below)), len(leaving))
    end = _middle(below) + _HEIGHT / 2 - _spread(coming.index((wing, below)), len(coming))
    x = _WIDTH + _LANE * (lanes[wing, below] + 0.8)
    colour, thick = _COLOURS[wing], 0.6 + 0.35 * count**0.5
    axes.plot([_WIDTH - 0.1, x, x], [start, start, end], color=colour, linewidth=thick, solid_capstyle="round")
    axes.annotate(
        "", (_WIDTH - 0.1, end), (x, end), arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": thick}
    )
    axes.text(
        x, (start + end) / 2, str(count), fontsize=7, ha="center", va="center", color=colour,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )  # fmt: skip


def _spread(index: int, count: int) -> float:
    """Return how far below the edge of its half one of several arrows meets a room."""
    return _HEIGHT / 2 * (index + 0.6) / (count + 0.2)


def _lanes(counts: Counter) -> dict[tuple[str, str], int]:
    """Give each pair of wings a lane beside the rooms, short ways first, so that no two of a lane meet."""
    order = list(WINGS)
    lanes, taken = {}, []
    for wing, below in sorted(counts, key=lambda pair: order.index(pair[1]) - order.index(pair[0])):
        top, bottom = order.index(wing), order.index(below)
        free = [k for k, spans in enumerate(taken) if all(bottom <= a or b <= top for a, b in spans)]
        lane = free[0] if free else len(taken)
        if not free:
            taken.append([])
        taken[lane].append((top, bottom))
        lanes[wing, below] = lane
    return lanes
