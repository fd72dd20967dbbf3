# SPDX-License-Identifier: GPL-3.0-or-later
"""Demo scenes, each built from primitives by a module of its own.

Every builder module has one public function, ``build()``, that starts from an empty factory file and returns the
finished `bpy.types.Scene`. ``python -m demo_blend`` writes the committed ``.blend`` file of each one listed in `DEMOS`.
"""

DEMOS = ("spinning_wheels",)
