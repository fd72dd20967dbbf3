# SPDX-License-Identifier: GPL-3.0-or-later
"""The two ways in which a render ends early."""


class Refused(Exception):
    """Something that will not be rendered as asked; the message tells the user why, and the way out."""


class Cancelled(Exception):
    """The user pressed Esc."""
