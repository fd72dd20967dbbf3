# SPDX-License-Identifier: GPL-3.0-or-later
"""Demo scenes, each built from primitives by a module of its own.

Every builder module has one public function, ``build()``, that starts from an empty factory file and returns the
finished `bpy.types.Scene`. ``python -m demo_blend`` writes the committed ``.blend`` file of each one listed in `DEMOS`.
"""

#: Where the paper's figures come from, and five scenes of today.
PAPER = ("motion_blur", "square_lens", "round_lens", "glossy_reflection", "moving_penumbra")
DEMOS = ("spinning_wheels", *PAPER, "interior", "windy_forest", "dandelion", "swinging_lamp", "blinking_signs")
