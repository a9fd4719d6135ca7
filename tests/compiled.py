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

from ocmm_core.composition import kernel_groups

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
        found = set(self._asked) if self._compiled else set(_loaded())
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


def _loaded() -> list[tuple[Any, Any]]:
    return [
        (value, tuple(called))
        for name, module in list(sys.modules.items())
        if name.startswith("ocmm_core.")
        for value in list(vars(module).values())
        if isinstance(value, Dispatcher)
        for called in list(value.overloads)
        if not any(isinstance(one, types.Literal) for one in called)
    ]
