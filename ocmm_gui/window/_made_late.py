"""What is made, and loaded, when it is first wanted."""

from __future__ import annotations

from PySide6.QtCore import QObject


class MadeLate(QObject):
    """Has parts that are made when they are first wanted, each a `cached_property`."""

    def is_made(self, name: str) -> bool:
        """Return whether the part of this name was wanted before."""
        # `cached_property` keeps what it made under its name.
        return name in self.__dict__
