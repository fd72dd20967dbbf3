"""The figures of docs/ that are quick to draw."""

import io

import pytest

pytest.importorskip("bpy")

from bench import figures


@pytest.mark.parametrize("draw", [figures.rooks, figures.arrangement])
def test_figures_are_drawn(draw):
    file = io.BytesIO()
    draw().savefig(file)
    assert file.getvalue().startswith(b"\x89PNG")
