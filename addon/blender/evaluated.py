# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated data that is written to for a render, and put back as it was."""


def render_settings(engine):
    """The settings of an engine's render, its own copy; `engine.render` is a method, which hides them."""
    return engine.path_resolve("render")


def values(owner):
    """All plain values of a part of the evaluated scene, by name."""
    return {
        prop.identifier: getattr(owner, prop.identifier)
        for prop in owner.bl_rna.properties
        if not prop.is_readonly
        and prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
        and not getattr(prop, "is_array", False)
    }


def put_back(owner, before):
    """Undo what was written to a part of the evaluated scene since `values`."""
    for name, value in values(owner).items():
        if value != before[name]:
            setattr(owner, name, before[name])


class Overwritten:
    """Values written to evaluated data, which can be put back.

    The next frame's evaluation starts from what it finds, so nothing of ours may be there.
    """

    def __init__(self):
        self._previous = {}
        self._parts = []

    def set(self, owner, **values):
        for name, value in values.items():
            self.keep(owner, name)
            setattr(owner, name, value)

    def keep(self, owner, *names):
        """Remember values that will be written."""
        for name in names:
            key = owner.as_pointer(), owner.bl_rna.identifier, name
            if key not in self._previous:
                value = getattr(owner, name)
                self._previous[key] = owner, name, value.copy() if hasattr(value, "copy") else value

    def keep_all(self, owner):
        """Remember all plain values of a part of the scene."""
        self._parts.append((owner, values(owner)))

    def put_back(self):
        """Make everything what it was."""
        while self._parts:
            put_back(*self._parts.pop())
        while self._previous:
            setattr(*self._previous.popitem()[1])
