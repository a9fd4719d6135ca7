"""Compile once all that is computed by compiled loops, on all cores."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from numba.core import event

from ocmm_core.composition._kernels import kernel_groups
from ocmm_core.host import HOST


@dataclass(frozen=True, slots=True)
class Compilation:
    """What was compiled."""

    listed: int
    """Functions that there are, each with its types."""
    compiled: int
    """Functions that were compiled now, also those that others call; the rest was there already."""


def compile_all(processes: int | None = None) -> Compilation:
    """Compile every listed function that is not there yet, and keep the results beside its file.

    Parameters
    ----------
    processes
        At the same time; as many as this process has cores where it is None.
    """
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
    """Compile a group of the list, and return how many functions had to be compiled."""
    counter = _Counter()
    with event.install_listener("numba:compile", counter):
        for module, name, types in kernel_groups()[number]:
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
