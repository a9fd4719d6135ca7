"""One function for many tasks on any site."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

from ocmm_core.cluster._site import HERE, Site, cluster, no_dask
from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.processes import processes_for, side_by_side

T = TypeVar("T")
R = TypeVar("R")

_PAYS = 64
"""Tasks from which local Dask pays: three seconds to start on two cores, 0.1 s a task."""


def nothing(thing: object) -> Sequence[bytes]:
    return ()


def run_tasks(
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    *,
    site: Site = HERE,
    contents: Callable[[T], Sequence[bytes]] = nothing,
    told: Callable[[int], None] = lambda done: None,
) -> Iterator[R | OcmmError]:
    """Yield the result of each thing in order; identical on every site.

    Closing the generator, or leaving it by an exception, cancels the rest.

    Parameters
    ----------
    work
        ``work(thing, *contents)``; a function of a module, or a `functools.partial` of one. Its
        exception is the answer for that thing. It may run twice if a worker was lost. Random
        numbers come from a seed in the thing.
    things
        Small and picklable, like the answers.
    named
        Name of the work on a thing, as the beginning of a sentence: "The reading of a.ocmm".
    contents
        Returns the bytes that a thing needs, called when submitted; a function of a module or a
        partial of one. Workers receive equal bytes once and verify their SHA-256.

    Raises
    ------
    InputError
        The site cannot or must not be used, or a worker is of another version.
    StorageError
        The scheduler cannot be reached, or has no workers.
    """
    site.check()
    many = len(things)
    if site.scheduler and many:
        dask = cluster()
        if dask is None:
            raise no_dask()
        yield from dask.over_scheduler(site, work, things, named, contents, told)
        return
    processes = site.workers
    if processes is None:
        processes = processes_for(many)
        dask = cluster() if site.dask and many >= _PAYS and processes > 1 else None
    else:
        processes = max(min(processes, many, 4 * HOST.processors()), 1)
        dask = cluster() if site.dask and processes > 1 else None
    if dask is not None and not multiprocessing.current_process().daemon:
        yield from dask.over_local(processes, work, things, named, contents, told)
        return
    # Read by the process that needs them, not sent through a pipe.
    here = work if contents is nothing else partial(_with_contents, work, contents)
    yield from side_by_side(here, things, processes, named, told)


def _with_contents(work: Callable[..., R], contents: Callable[[T], Sequence[bytes]], thing: T) -> R:
    return work(thing, *contents(thing))
