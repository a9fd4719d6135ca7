"""Compares every call of a compiled function with the list that the set-up compiles.

A function missing from the list would be compiled while the user waits. After a complete
compilation numba only loads functions; the check then uses the loaded ones. If a test compiles for
another processor, the check uses the requests of Python.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from numba import types
from numba.core import event
from numba.core.dispatcher import Dispatcher

from ocmm_cli import kernel_groups
from ocmm_core.cpu_features import Deferred

_FOR_TESTS = {
    "ellipse_foot", "ambiguity_score", "normal_equations", "backward", "cholesky", "forward",
}  # fmt: skip
"""Called directly by tests, but only from compiled functions in the product."""


def load_compiled(*packages: str) -> None:
    """Load the compiled functions of packages, for forks of this process.

    numba needs a third of a second for the first function of a process, and milliseconds for each
    more. As another processor (`tests.processor`) nothing is loaded: it may not be compiled yet.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    for group in kernel_groups():
        for module, name, called in group:
            if module.startswith(packages):
                getattr(import_module(module), name).compile(called)


class CompileWatch(event.Listener):  # type: ignore[misc] # numba ships no annotations
    """Records the compilations requested by Python; their callees are built in."""

    def __init__(self) -> None:
        self._depth = 0
        self._asked: list[tuple[Any, Any]] = []
        self._told: set[str] = set()
        self._loaded = _Loaded()
        self._compiled = False
        self._listed = {
            (module, name, wanted) for group in kernel_groups() for module, name, wanted in group
        }
        event.register("numba:compile", self)

    def on_start(self, event: Any) -> None:  # its type is numba's
        """Record the request."""
        self._compiled = True
        if self._depth == 0:
            self._asked.append((event.data["dispatcher"], tuple(event.data["args"])))
        self._depth += 1

    def on_end(self, event: Any) -> None:  # as above
        """Count down."""
        self._depth -= 1

    def unlisted(self) -> list[str]:
        """Return a line for each call since the last question that the list does not have."""
        found = set(self._asked) if self._compiled else set(self._loaded.new_calls())
        self._asked.clear()
        lines = {
            f"{function.__module__} {function.__name__} {' '.join(map(str, called))}"
            for dispatcher, called in found
            for function in [dispatcher.py_func]
            if function.__module__.startswith("ocmm_core.")
            and function.__name__ not in _FOR_TESTS
            and (function.__module__, function.__name__, called) not in self._listed
        }
        new = lines - self._told
        self._told |= new
        return sorted(new)


class _Loaded:
    """What compiled functions of the product are there for; each module is read once."""

    def __init__(self) -> None:
        self._modules: dict[str, Any] = {}
        self._dispatchers: list[Any] = []
        self._seen = (0, 0)

    def new_calls(self) -> list[tuple[Any, Any]]:
        """Return each function with the types that it was loaded or compiled for.

        Empty if no module and no type came since the last call: it runs after every test.
        """
        if self._seen == (len(sys.modules), self._count()):
            return []
        modules = len(sys.modules)
        for name, module in list(sys.modules.items()):
            if self._modules.get(name) is module or not name.startswith("ocmm_core."):
                continue
            if getattr(module.__spec__, "_initializing", False):
                # Another thread is reading the file; it is checked at the next call.
                modules = 0
                continue
            self._modules[name] = module
            self._dispatchers += [
                value
                for value in vars(module).values()
                if isinstance(value, (Deferred, Dispatcher))
            ]
        self._seen = (modules, self._count())
        return [
            (dispatcher, tuple(called))
            for dispatcher in self._made()
            for called in list(dispatcher.overloads)
            if not any(isinstance(one, types.Literal) for one in called)
        ]

    def _count(self) -> int:
        return sum(len(dispatcher.overloads) for dispatcher in self._made())

    def _made(self) -> list[Any]:
        return [one for one in self._dispatchers if not isinstance(one, Deferred) or one.is_made()]
