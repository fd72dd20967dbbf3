# SPDX-License-Identifier: GPL-3.0-or-later
# Every developer command.  `uv run just` lists them; on a bare machine `.ci/setup just test` sets all up first.

root := env("SPECTRAL_TILES_WINDOW_ROOT", env("XDG_CACHE_HOME", env("HOME") / ".cache") / "spectral_tiles/window_root")

[private]
default:
    @just --list

# Set up all that is needed
setup:
    .ci/setup

# Run all tests, or some: just test tests/plan -k seed
test *options:
    uv run pytest {{ options }}

# Run the tests in a real Blender window (the first time makes a Debian root of 1.4 GB; needs root's rights)
test-window *options:
    SPECTRAL_TILES_WINDOW_ROOT="{{ root }}" uv run pytest tests/ui {{ options }}

# Check style
lint:
    uv run ruff check
    uv run ruff format --check

# Put the style right
format:
    uv run ruff check --fix
    uv run ruff format

# What a bare machine runs on a submission: set-up, style, tests
ci:
    bash .ci/run

# Render the demo by Cycles and by Spectral Tiles, side by side into out/
demo *options:
    uv run python -m bench demo --out out {{ options }}

# Measure a folder of .blend files: just real FOLDER --json out/real.json
real folder *options:
    uv run python -m bench real {{ folder }} {{ options }}

# Measure anything else: just bench quality --quick
bench *options:
    uv run python -m bench {{ options }}

# Write out/report/report.html: sentences, pictures at equal time, the paper's experiments, tables
report *options:
    uv run python -m bench report {{ options }}

# See whether the documents' figures still hold
verify *options:
    uv run python -m bench verify {{ options }}

# Draw the picture of the house, and the figures of docs/how_it_works.md
pictures:
    uv run python -m bench house --out docs/house.png
    uv run python -m bench.figures --out docs/figures

# Write the demo scenes' .blend files
scenes:
    uv run python -m demo_blend

# Make the extension's zip in dist/
archive *options:
    uv run python -m bench archive {{ options }}

# Make the zip, check it in Blender's module and in a window, and write the release's notes
release *options:
    SPECTRAL_TILES_WINDOW_ROOT="{{ root }}" uv run python -m bench release {{ options }}
