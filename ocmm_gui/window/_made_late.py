"""Parts made, and loaded, at their first use."""

from __future__ import annotations

from PySide6.QtCore import QObject


class MadeLate(QObject):
    """Base of objects with late parts, each a `cached_property`."""

    def is_made(self, name: str) -> bool:
        """Return whether the part of this name was used before."""
        # `cached_property` stores its value under its name.
        return name in self.__dict__
