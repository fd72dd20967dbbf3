# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements of Spectral Tiles against Cycles itself. ``python -m bench --help`` lists the commands.

The data's way: a scene file (`scene_files`) and settings make a job, a fresh process renders it, and its images are
compared with a converged reference. What artists ask is asked of any .blend files at their own settings (`real`, whose
parts are the modules named after it, and `demo`); what the arrangement of samples is worth, of small scenes at equal
samples (`jobs`, `worker`, `reference`, `metrics`; `errors`, `quality`, `filters`, `frames`, `timing`, and `paper` with
`samplers` and `equal_quality`). Commands print tables; `document` puts them on a page.
"""
