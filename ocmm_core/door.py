"""Lazy exports of packages (PEP 562).

Others import from the package alone (`from ocmm_core.camera import Rig`), checked by
tests/doors.py; its files load on first use. Its ``__init__`` lists the exports once, as imports
under ``if TYPE_CHECKING``, which type checkers follow; at run time `door` takes the list from them.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import CodeType
from typing import TYPE_CHECKING

__all__ = ["TYPE_CHECKING", "door"]


def door(room: str) -> Callable[[str], object]:
    """Return the ``__getattr__`` of the package that calls, which loads and caches its names.

    A name that is that of a file without its underscore is the module itself, if it has no such
    name. AttributeError for other names.
    """
    homes = _homes(room, sys._getframe(1).f_code)  # noqa: SLF001 - as in collections.namedtuple

    def enter(name: str) -> object:
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        value: object = import_module(f"{room}._{name}" if home == room else home)
        value = value if home == room else getattr(value, name)
        setattr(sys.modules[room], name, value)
        return value

    return enter


def _homes(room: str, code: CodeType) -> dict[str, str]:
    """Return the module of each name that the code of a package imports from its own files.

    Python compiles the imports that it never runs as well. A code object lists names in the order
    of their first use: a module, then the names imported from it.
    """
    homes: dict[str, str] = {}
    home = ""
    for name in code.co_names:
        if name == room or name.startswith(f"{room}."):
            home = name
        elif home and not name.startswith("_"):
            homes[name] = home
    return homes
