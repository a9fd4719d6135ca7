"""One function for many tasks, and which way it takes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

from ocmm_core.cluster._site import HERE, Site, has_dask
from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.processes import processes_for, side_by_side

T = TypeVar("T")
R = TypeVar("R")

_PAYS = 64
"""Tasks from which Dask is started on this computer: it takes three seconds on two cores to start,
and a task of a tenth of a second each then gives back as much."""


def nothing(thing: object) -> Sequence[bytes]:
    """Return that a thing needs no bytes."""
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
    """Give what came of each thing, in their order, whichever is done first.

    What comes out does not depend on the site. Whoever closes this generator, or leaves it by an
    exception, gives up what is not done.

    Parameters
    ----------
    work
        ``work(thing, *contents)``; a function of a module, or a `functools.partial` of one. What it
        raises is the answer for that thing, and the others go on. It may be done twice, where a
        worker was lost. Random numbers come from a seed in the thing.
    things
        Small; can be sent to another process, as the answers can.
    named
        What the work on a thing is called, as the beginning of a sentence: "The reading of a.ocmm".
    site
        Where.
    contents
        The bytes that a thing needs, called when it is its turn; a function of a module or a
        partial of one. A worker gets equal bytes once and looks at their SHA-256.
    told
        How many are done.

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
        from ocmm_core.cluster._over_dask import over_scheduler

        yield from over_scheduler(site, work, things, named, contents, told)
        return
    processes = site.workers
    if processes is None:
        processes = processes_for(many)
        by_dask = site.dask and many >= _PAYS and processes > 1 and has_dask()
    else:
        processes = max(min(processes, many, 4 * HOST.processors()), 1)
        by_dask = site.dask and processes > 1 and has_dask()
    if by_dask and not multiprocessing.current_process().daemon:
        from ocmm_core.cluster._over_dask import over_local

        yield from over_local(processes, work, things, named, contents, told)
        return
    # Read where they are needed: what is on this disk need not go through a pipe.
    here = work if contents is nothing else partial(_with_contents, work, contents)
    yield from side_by_side(here, things, processes, named, told)


def _with_contents(work: Callable[..., R], contents: Callable[[T], Sequence[bytes]], thing: T) -> R:
    return work(thing, *contents(thing))
