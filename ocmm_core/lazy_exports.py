"""Lazy exports of packages (PEP 562).

Others import from the package alone (`from ocmm_core.camera import Rig`), checked by
tests/package_imports.py; its modules load on first use. Its ``__init__`` lists the exports once, as
imports under ``if TYPE_CHECKING``, from which `lazy_exports` takes the list at run time.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import CodeType
from typing import TYPE_CHECKING

__all__ = ["TYPE_CHECKING", "lazy_exports"]


def lazy_exports(package: str) -> Callable[[str], object]:
    """Return the ``__getattr__`` of the package that calls, which loads and caches its names.

    A name that is that of a file without its underscore is the module itself, if it has no such
    name. AttributeError for other names.
    """
    homes = _homes(package, sys._getframe(1).f_code)  # noqa: SLF001 - as in collections.namedtuple

    def load(name: str) -> object:
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value: object = import_module(f"{package}._{name}" if home == package else home)
        value = value if home == package else getattr(value, name)
        setattr(sys.modules[package], name, value)
        return value

    return load


def _homes(package: str, code: CodeType) -> dict[str, str]:
    """Return the module of each name that the code of a package imports from its own files.

    Python compiles the imports that it never runs as well. A code object lists names in the order
    of their first use: a module, then the names imported from it.
    """
    homes: dict[str, str] = {}
    home = ""
    for name in code.co_names:
        if name == package or name.startswith(f"{package}."):
            home = name
        elif home and not name.startswith("_"):
            homes[name] = home
    return homes
