"""Tasks on the workers of a Dask scheduler.

The computer that asks keeps what every open task needs, and never has more than a few tasks a
worker open: neither the scheduler nor this one holds all jobs at once. A lost worker is Dask's
matter, which does its tasks again; a lost scheduler is ours: the open tasks are given to it anew
when it is back.
"""

from __future__ import annotations

import contextlib
import logging
import math
import queue
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import dask
from distributed import Client, Future, KilledWorker, LocalCluster
from distributed.security import Security

from ocmm_core.blas import use_one_thread
from ocmm_core.cluster._contents import Contents
from ocmm_core.cluster._sentences import (
    died,
    no_workers,
    not_reached,
    other_version,
    scheduler_lost,
)
from ocmm_core.cluster._site import Site
from ocmm_core.cluster._worker import Asked, Done, Refused, do, versions
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained
from ocmm_core.leftovers import scratch_folder

T = TypeVar("T")
R = TypeVar("R")

_CONNECT_S = 15.0
_BACK_S = 120.0
"""How long a scheduler may be gone, and how long one may be without workers."""
_LOOK_S = 1.0
_AHEAD = 2
"""Open tasks a worker thread: one is done while the next arrives."""
_LOSSES = 3
"""So often the scheduler may be lost between two answers."""
_BUNDLE_S, _LARGEST = 0.4, 8
"""Things that take less go to a worker together, up to so many: the scheduler and this computer
have as much to do for a task that takes a millisecond as for one that takes a minute."""

_CONFIG = {
    # A job of some megabytes is no mistake.
    "distributed.admin.large-graph-warning-threshold": "1GB",
    "distributed.comm.timeouts.connect": "15s",
    # No page of Dask, no memory on the disk: spilled results would be pickles in files.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.OPENBLAS_NUM_THREADS": 1,
    "distributed.nanny.pre-spawn-environ.OMP_NUM_THREADS": 1,
}


def over_scheduler(
    site: Site,
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    contents: Callable[[T], Sequence[bytes]],
    told: Callable[[int], None],
) -> Iterator[R | OcmmError]:
    """Give what came of each thing, done by the workers of a scheduler; see `run_tasks`."""
    security = None
    if site.scheduler.startswith("tls:"):
        security = Security(
            tls_ca_file=str(site.ca), tls_client_cert=str(site.cert),
            tls_client_key=str(site.key), require_encryption=True,
        )  # fmt: skip
    with _quiet(), dask.config.set(_CONFIG):
        tasks = _Tasks(
            lambda seconds: _client(site.scheduler, security, seconds), site.scheduler,
            work, things, named, contents, told,
        )  # fmt: skip
        yield from tasks.run()


def over_local(
    workers: int,
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    contents: Callable[[T], Sequence[bytes]],
    told: Callable[[int], None],
) -> Iterator[R | OcmmError]:
    """Give what came of each thing, done by processes of Dask on this computer.

    They speak TLS with keys of their own: another user of this computer must not run programs as
    this one.
    """
    use_one_thread()
    with (
        _quiet(),
        dask.config.set(_CONFIG),
        scratch_folder("workers") as scratch,
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
            # It always has a page of its state: on this computer alone, on any free port.
            dashboard_address="127.0.0.1:0", memory_limit=0, local_directory=str(scratch),
            silence_logs=logging.CRITICAL, security=Security.temporary(),
        ) as cluster,
    ):  # fmt: skip
        tasks = _Tasks(
            lambda seconds: Client(cluster, timeout=seconds, set_as_default=False),
            cluster.scheduler_address, work, things, named, contents, told,
        )  # fmt: skip
        yield from tasks.run()


def _client(address: str, security: Security | None, seconds: float) -> Client:
    try:
        return Client(
            address, security=security, timeout=seconds, set_as_default=False,
            name=f"ocmm-{uuid.uuid4().hex[:8]}",
        )  # fmt: skip
    except (OSError, TimeoutError, ValueError) as error:
        why = str(error).strip().splitlines()
        raise not_reached(address, why[0][:200] if why else type(error).__name__) from error


@dataclass(slots=True)
class _Open:
    """A task that was given out, about one thing or some."""

    places: tuple[int, ...]
    future: Future
    hashes: tuple[str, ...]


@dataclass(slots=True)
class _Tasks:
    """The tasks of one call.

    Attributes
    ----------
    connect
        Makes a client within so many seconds.
    alone
        Places that are given out one by one, before those that have not been: of a task that ended
        its workers, and of those that were open when the scheduler went.
    thing_s
        How long one thing takes.
    """

    connect: Callable[[float], Client]
    address: str
    work: Callable[..., Any]
    things: Sequence[Any]
    named: Callable[[Any], str]
    contents: Callable[[Any], Sequence[bytes]]
    told: Callable[[int], None]
    open: dict[str, _Open] = field(default_factory=dict)
    kept: Contents = field(default_factory=Contents)
    alone: deque[int] = field(default_factory=deque)
    thing_s: float = math.inf
    done: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)

    def run(self) -> Iterator[Any]:
        """Give the answers in the order of the things."""
        found: dict[int, Any] = {}
        begun = given = losses = done = taken = 0
        ours = versions()
        client = self._connected(ours)
        try:
            room = self._room(client)
            self.told(0)
            while given < len(self.things):
                while (self.alone or begun < len(self.things)) and len(self.open) < room:
                    places = self._following(begun, room)
                    begun = max(begun, places[-1] + 1)
                    failed = self._give(client, places, ours)
                    found |= failed
                    done += len(failed)
                while given in found:
                    yield found.pop(given)
                    given += 1
                if not self.open:
                    continue
                key = self._next(client)
                if key is None:
                    losses += 1
                    if losses > _LOSSES:
                        raise scheduler_lost(self.address)
                    client = self._again(client, ours)
                    continue
                answered = self._take(key)
                if answered is None:
                    continue
                if isinstance(answered, Refused):
                    raise other_version("A worker", answered.versions, ours)
                found |= answered
                losses = 0
                for _ in answered:
                    done += 1
                    self.told(done)
                taken += 1
                room = self._room(client) if taken % 16 == 0 else room
        finally:
            for one in self.open.values():
                with contextlib.suppress(Exception):
                    one.future.cancel()
            self.open.clear()
            self.kept.clear()
            with contextlib.suppress(Exception):
                client.close(timeout=5.0)

    def _connected(self, ours: str) -> Client:
        client = self.connect(_CONNECT_S)
        try:
            self._wait_for_workers(client)
            for worker, theirs in _all_versions(client).items():
                if theirs != ours:
                    raise other_version(worker, theirs, ours)
        except BaseException:
            client.close(timeout=5.0)
            raise
        return client

    def _wait_for_workers(self, client: Client) -> None:
        try:
            client.wait_for_workers(1, timeout=_BACK_S)
        except TimeoutError as error:
            raise no_workers(self.address, _BACK_S) from error

    def _room(self, client: Client) -> int:
        """Return how many tasks may be open: workers come and go."""
        with contextlib.suppress(Exception):
            return max(_AHEAD * int(sum(client.nthreads().values())), _AHEAD)
        return _AHEAD

    def _following(self, begun: int, room: int) -> tuple[int, ...]:
        """Return what is given out next: fewer together towards the end, for all workers."""
        if self.alone:
            return (self.alone.popleft(),)
        left = len(self.things) - begun
        together = min(int(_BUNDLE_S / max(self.thing_s, 1e-6)), _LARGEST, left // (2 * room))
        return tuple(range(begun, begun + max(together, 1)))

    def _give(self, client: Client, places: Sequence[int], ours: str) -> dict[int, OcmmError]:
        """Give a task out; return why some of it cannot be."""
        failed: dict[int, OcmmError] = {}
        asked: list[Asked] = []
        handed: list[bytes | Future] = []
        for place in places:
            thing = self.things[place]
            name = self.named(thing)
            try:
                contents = tuple(self.contents(thing))
            except Exception as error:
                failed[place] = contained(error, name)
                continue
            hashes, given = self.kept.hand(client, contents)
            asked.append(Asked(thing, name, hashes))
            handed += given
        if not asked:
            return failed
        key = f"ocmm-{uuid.uuid4().hex}"
        future = client.submit(do, ours, self.work, asked, *handed, key=key, pure=False)
        self.open[key] = _Open(
            tuple(place for place in places if place not in failed),
            future,
            tuple(sha256 for one in asked for sha256 in one.hashes),
        )
        done = self.done
        future.add_done_callback(lambda _, key=key: done.put(key))
        return failed

    def _next(self, client: Client) -> str | None:
        """Return the key of a task that is done; None where the scheduler was lost."""
        since = time.monotonic()
        while True:
            with contextlib.suppress(queue.Empty):
                key = self.done.get(timeout=_LOOK_S)
                if key not in self.open:
                    continue
                return None if self.open[key].future.status in ("cancelled", "lost") else key
            if client.status != "running":
                return None
            waited = time.monotonic() - since
            if waited > 5.0 and not _has_workers(client):
                if waited > _BACK_S:
                    raise no_workers(self.address, waited)
            elif waited > 5.0:
                since = time.monotonic() - 5.0

    def _take(self, key: str) -> dict[int, Any] | Refused | None:
        """Return the answers of a task by their places; None where it has to be asked again."""
        one = self.open[key]
        answers: dict[int, Any] = {}
        try:
            done: Done | Refused = one.future.result(timeout=_BACK_S)
            if isinstance(done, Refused):
                return done
            answers = dict(zip(one.places, done.answers, strict=True))
            self.thing_s = done.seconds / len(one.places)
        except KilledWorker:
            if len(one.places) > 1:
                # Which of them it was is not known until each is tried alone.
                self.alone.extend(one.places)
            else:
                answers = {place: died(self._name(place)) for place in one.places}
        except Exception as error:
            if one.future.status in ("cancelled", "lost", "pending"):
                # Done, but its worker went before the answer came; Dask does it again, or the
                # scheduler is gone, which the next look tells.
                one.future.add_done_callback(lambda _: self.done.put(key))
                return None
            answers = {place: contained(error, self._name(place)) for place in one.places}
        del self.open[key]
        self.kept.give_back(one.hashes)
        return answers

    def _name(self, place: int) -> str:
        return self.named(self.things[place])

    def _again(self, client: Client, ours: str) -> Client:
        """Return a new client with all open tasks given out anew."""
        with contextlib.suppress(Exception):
            client.close(timeout=2.0)
        # What could be read before is read again; where it cannot be any more, that is the answer.
        self.alone.extend(sorted(place for one in self.open.values() for place in one.places))
        self.open.clear()
        self.kept.clear()
        until = time.monotonic() + _BACK_S
        while True:
            try:
                return self._connected(ours)
            except OcmmError as error:
                if error.code != "cluster.unreachable" or time.monotonic() > until:
                    raise
                time.sleep(_LOOK_S)


def _all_versions(client: Client) -> dict[str, str]:
    """Return the versions of all; one that knows no such thing is of another version."""
    found: dict[str, object] = {"The scheduler": _of_scheduler(client)}
    for worker, one in client.run(versions, on_error="return").items():
        found[f"Worker {worker}"] = one
    return {
        name: one if isinstance(one, str) else f"another version ({type(one).__name__})"
        for name, one in found.items()
    }


def _of_scheduler(client: Client) -> object:
    # It unpacks what it hands on, so it needs the same packages.
    try:
        return client.run_on_scheduler(versions)
    except Exception as error:
        return error


def _has_workers(client: Client) -> bool:
    with contextlib.suppress(Exception):
        return bool(client.nthreads())
    return False


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep off the terminal what Dask logs of lost workers: an answer or an error counts."""
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado")]
    before = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for one, level in zip(loggers, before, strict=True):
            one.setLevel(level)
