"""Lazy exports of packages (PEP 562).

Others import from the package alone (`from ocmm_core.camera import Rig`), checked by
tests/doors.py; its files load on first use. Type checkers read ``if TYPE_CHECKING``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module


def door(room: str, **homes: str) -> Callable[[str], object]:
    """Return the ``__getattr__`` of a package, which loads and caches its names.

    ``homes``: each file inside with the names that it exports, separated by blanks. A name that is
    that of the file without its underscore is the module itself, if it has no such name.
    AttributeError for other names.
    """
    found_in = {name: home for home, names in homes.items() for name in names.split()}

    def enter(name: str) -> object:
        home = found_in.get(name)
        if home is None:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        module = import_module(f"{room}.{home}")
        value: object = module if _is_the_file(module, home, name) else getattr(module, name)
        setattr(sys.modules[room], name, value)
        return value

    return enter


def _is_the_file(module: object, home: str, name: str) -> bool:
    return home == f"_{name}" and not hasattr(module, name)
