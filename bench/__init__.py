# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements of Spectral Tiles against Cycles itself. ``python -m bench --help`` lists the commands.

The data's way: a scene file (`scene_files`) and settings make a job, a fresh process renders it (`jobs`, `worker`), its
images are compared with a converged reference (`reference`, `metrics`), and a command (`errors`, `quality`, `filters`,
`adaptive`, `timing`, `demo`) prints the table. `paper` (with `samplers`, `equal_quality`) and `report` put figures on
pages (`document`).
"""
