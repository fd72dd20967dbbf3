# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be sampled where: pure numpy."""
