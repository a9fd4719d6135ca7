"""Compile all numba functions in advance, on all cores."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from numba.core import event

from ocmm_cli._kernels import kernel_groups
from ocmm_core.host import HOST


@dataclass(frozen=True, slots=True)
class Compilation:
    """Result of `compile_all`."""

    listed: int
    """Number of listed functions, counted per signature."""
    compiled: int
    """Functions compiled now, callees included; others were cached."""


def compile_all(processes: int | None = None) -> Compilation:
    """Compile all uncached functions, in `processes` or as many as there are cores."""
    wanted = kernel_groups()
    count = min(processes or HOST.processors(), len(wanted))
    if count == 1:
        compiled = sum(map(compile_group, range(len(wanted))))
    else:
        spawned = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(count, mp_context=spawned) as pool:
            compiled = sum(pool.map(compile_group, range(len(wanted))))
    return Compilation(sum(map(len, wanted)), compiled)


def compile_group(number: int) -> int:
    """Compile a group of the list, and return the number of compiled functions."""
    counter = _Counter()
    with event.install_listener("numba:compile", counter):
        for module, name, types in kernel_groups()[number]:
            # A package of this program may be left out.
            if find_spec(module.partition(".")[0]) is None:
                continue
            getattr(import_module(module), name).compile(types)
    return counter.count


class _Counter(event.Listener):  # type: ignore[misc] # numba ships no annotations
    def __init__(self) -> None:
        self.count = 0

    def on_start(self, event: Any) -> None:  # its type is numba's
        """Count."""
        self.count += 1

    def on_end(self, event: Any) -> None:  # as above
        """Do nothing."""
