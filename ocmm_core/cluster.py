"""Parallel tasks of one function: in this process, local processes, or a scheduler's workers.

In: a function of a module, its inputs, bytes that it needs. Out: the result of each input, in
order, bit-identical for any number of workers. Dask is added by `ocmm_shop`. It must not know what
is computed; seeds belong to tasks, never to workers.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.host import HOST, is_loopback
from ocmm_core.plugins import install_line, load
from ocmm_core.processes import processes_for, side_by_side


@dataclass(frozen=True, slots=True)
class Site:
    """Where tasks are computed."""

    scheduler: str = ""
    """``tls://HOST:PORT`` or ``tcp://HOST:PORT`` of a Dask scheduler; empty: this computer."""
    workers: int | None = None
    """Local processes; None for one per core if it pays. Unused with a scheduler."""
    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None
    """`ca`, `cert`, `key`: PEM files for ``tls``: authority, certificate, key of this computer."""
    unencrypted: bool = False
    """Allow a networked scheduler without TLS."""
    dask: bool = False
    """Local processes may be Dask's if installed and worthwhile; else they are our own, which start
    sooner and do not retry the task of a process that ended. Scripts that set it guard their main
    module, as for `multiprocessing`."""

    def check(self) -> None:
        """Raise InputError if the site cannot or must not be used."""
        if not self.scheduler:
            return
        try:
            parts = urlsplit(self.scheduler)
            host, port = parts.hostname or "", parts.port
        except ValueError:
            raise _bad_address(self.scheduler, "cannot be read") from None
        if parts.scheme not in ("tcp", "tls") or not host or port is None:
            raise _bad_address(self.scheduler, "is none of tcp://HOST:PORT and tls://HOST:PORT")
        if parts.path or parts.query or parts.fragment or parts.username is not None:
            raise _bad_address(self.scheduler, "has more than a host and a port")
        if parts.scheme == "tcp" and not is_loopback(host) and not self.unencrypted:
            raise _not_protected(self.scheduler)
        if parts.scheme == "tls":
            files = {"the CA": self.ca, "a certificate": self.cert, "its key": self.key}
            for what, path in files.items():
                if path is None:
                    raise _no_certificates(what)
                if not path.is_file() or not os.access(path, os.R_OK):
                    raise _no_certificates(f"{what}, but {path} cannot be read")
        if not has_dask():
            raise no_dask()


HERE = Site()


@dataclass(frozen=True, slots=True)
class Cluster:
    """Dask, as `ocmm_shop` adds it by an entry point of `ocmm.clusters`.

    Both yield the answer of each thing in order, from work, things, their names, their contents and
    whom to tell how many are done.
    """

    over_scheduler: Callable[..., Iterator[Any]]
    """First argument: the site."""
    over_local: Callable[..., Iterator[Any]]
    """First argument: the number of processes."""


def cluster() -> Cluster | None:
    """Return Dask; None if it or the package `ocmm_shop` is not installed."""
    return load("ocmm.clusters", "dask", Cluster) if has_dask() else None


def has_dask() -> bool:
    """Return whether the extra `shop` is installed, without loading it."""
    return all(importlib.util.find_spec(name) is not None for name in ("dask", "distributed"))


def no_dask() -> InputError:
    """Return the error of a scheduler without Dask."""
    return InputError(
        "cluster.dask",
        "Dask is not installed, so a scheduler cannot be used.",
        f"Install it: {install_line('shop')}. Or leave out --scheduler to compute here.",
    )


def _bad_address(text: str, why: str) -> InputError:
    return InputError(
        "cluster.address",
        f"The address of the scheduler '{text[:200]}' {why}.",
        "Write it like tls://SERVER:8786, or tcp://127.0.0.1:8786 on this computer.",
    )


def _not_protected(text: str) -> InputError:
    return InputError(
        "cluster.unencrypted",
        f"{text}: without TLS anybody in that network can run programs on the workers.",
        "Start scheduler and workers with certificates and give tls://... "
        "(docs/integrator/cluster.md); "
        "--unencrypted is for a network of their own.",
    )


def _no_certificates(missing: str) -> InputError:
    return InputError(
        "cluster.certificates",
        f"TLS to the scheduler needs {missing}.",
        "Give --scheduler-ca, --scheduler-cert and --scheduler-key (docs/integrator/cluster.md).",
    )


T = TypeVar("T")
R = TypeVar("R")

_PAYS = 64
"""Tasks from which local Dask pays: three seconds to start on two cores, 0.1 s a task."""


def nothing(thing: object) -> Sequence[bytes]:
    """Return no bytes: the tasks need none."""
    return ()


def run_tasks(
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    *,
    site: Site = HERE,
    contents: Callable[[T], Sequence[bytes]] = nothing,
    on_done: Callable[[int], None] = lambda done: None,
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
        yield from dask.over_scheduler(site, work, things, named, contents, on_done)
        return
    processes = site.workers
    if processes is None:
        processes = processes_for(many)
        dask = cluster() if site.dask and many >= _PAYS and processes > 1 else None
    else:
        processes = max(min(processes, many, 4 * HOST.processors()), 1)
        dask = cluster() if site.dask and processes > 1 else None
    if dask is not None and not multiprocessing.current_process().daemon:
        yield from dask.over_local(processes, work, things, named, contents, on_done)
        return
    # Read by the process that needs them, not sent through a pipe.
    here = work if contents is nothing else partial(_with_contents, work, contents)
    yield from side_by_side(here, things, processes, named, on_done)


def _with_contents(work: Callable[..., R], contents: Callable[[T], Sequence[bytes]], thing: T) -> R:
    return work(thing, *contents(thing))
