# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m demo_blend [NAME ...]``: write the committed .blend files again."""

import argparse
from importlib import import_module

import addon
from demo_blend import DEMOS
from demo_blend.files import write_blend


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m demo_blend", description="Build the demo scenes' .blend files.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(DEMOS)}; all if none is given")
    names = parser.parse_args().names or DEMOS
    if unknown := set(names) - set(DEMOS):
        parser.error(f"no such scene: {', '.join(sorted(unknown))}")
    addon.register()
    for name in names:
        path = write_blend(import_module(f"demo_blend.{name}").build)
        print(f"{path.name}: {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
