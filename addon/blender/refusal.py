# SPDX-License-Identifier: GPL-3.0-or-later
"""The two ways in which a render, or what is made for one, ends early."""


class Refused(Exception):
    """Something that will not be rendered as asked; the message tells the user why, and the way out."""


class Cancelled(Exception):
    """The user pressed Esc, or stopped what was made in the background."""
