"""Holds every call of a compiled function against the list that the set-up compiles.

What is not in the list would be compiled in front of whoever uses the product. Where all was
compiled before, numba only loads what is called; what was loaded is looked at then. Where a
test compiles itself, because its processor is another one, what Python asked for is looked at.
"""

from __future__ import annotations

import sys
from typing import Any

from numba import types
from numba.core import event
from numba.core.dispatcher import Dispatcher

from ocmm_cli import kernel_groups

_FOR_TESTS = {
    "ellipse_foot", "ambiguity_score", "normal_equations", "backward", "cholesky", "forward",
}  # fmt: skip
"""What tests call by itself, the product only from compiled functions."""


class CompileWatch(event.Listener):  # type: ignore[misc] # numba ships no annotations
    """Remembers what Python asked to be compiled; what that asked for in turn is built into it."""

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
        """Remember what was asked for."""
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
        self._dispatchers: list[Dispatcher] = []
        self._seen = (0, 0)

    def new_calls(self) -> list[tuple[Any, Any]]:
        """Return each function with the types that it was loaded or compiled for.

        Nothing, where no module and no type came since the last question: it is asked after every
        test.
        """
        if self._seen == (len(sys.modules), self._count()):
            return []
        modules = len(sys.modules)
        for name, module in list(sys.modules.items()):
            if self._modules.get(name) is module or not name.startswith("ocmm_core."):
                continue
            if getattr(module.__spec__, "_initializing", False):
                # Another thread reads its file just now; it is looked at the next time.
                modules = 0
                continue
            self._modules[name] = module
            self._dispatchers += [
                value for value in vars(module).values() if isinstance(value, Dispatcher)
            ]
        self._seen = (modules, self._count())
        return [
            (dispatcher, tuple(called))
            for dispatcher in self._dispatchers
            for called in list(dispatcher.overloads)
            if not any(isinstance(one, types.Literal) for one in called)
        ]

    def _count(self) -> int:
        return sum(len(dispatcher.overloads) for dispatcher in self._dispatchers)
