"""Open tasks: submitted, done, and resubmitted.

The client keeps the inputs of every open task, and opens only a few tasks per worker: neither the
scheduler nor the client holds all jobs at once. Dask repeats the tasks of a lost worker; after a
loss of the scheduler, the client resubmits the open tasks.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import queue
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from distributed import Client, Future, KilledWorker

from ocmm_core.errors import InternalError, OcmmError, StorageError
from ocmm_core.failure import contained
from ocmm_shop.cluster import _worker

_IDLE = 8
"""Contents kept on the workers although no open task needs them."""
_SMALL = 1024
"""Smaller contents are sent with every task."""
_SEEN = 4096
"""Number of remembered hashes."""


@dataclass(slots=True)
class TaskContents:
    """Contents of the tasks of one call, by their SHA-256."""

    kept: dict[str, Future] = field(default_factory=dict)
    seen: dict[str, None] = field(default_factory=dict)
    users: Counter[str] = field(default_factory=Counter)

    def hand(
        self, client: Client, contents: Sequence[bytes]
    ) -> tuple[tuple[str, ...], list[bytes | Future]]:
        """Return the hashes of a thing's contents, and what its task gets for each."""
        hashes = tuple(hashlib.sha256(one).hexdigest() for one in contents)
        return hashes, [
            self._handed(client, sha256, content)
            for sha256, content in zip(hashes, contents, strict=True)
        ]

    def _handed(self, client: Client, sha256: str, content: bytes) -> bytes | Future:
        """Return the argument of a task for a content: the bytes themselves the first time.

        Keeping them on a worker is a task as costly as the work, and maybe for nothing.
        """
        self.users[sha256] += 1
        if sha256 not in self.kept:
            if sha256 not in self.seen or len(content) < _SMALL:
                self.seen[sha256] = None
                if len(self.seen) > _SEEN:
                    del self.seen[next(iter(self.seen))]
                return content
            self.kept[sha256] = client.submit(_worker.held, content, key=f"ocmm-content-{sha256}")
        return self.kept[sha256]

    def give_back(self, hashes: Sequence[str]) -> None:
        """Note that a task is done; contents that no task needs are soon dropped."""
        for sha256 in hashes:
            self.users[sha256] -= 1
            if self.users[sha256] <= 0 and sha256 not in self.kept:
                del self.users[sha256]
        idle = [sha256 for sha256 in self.kept if self.users[sha256] <= 0]
        for sha256 in idle[:-_IDLE]:
            del self.kept[sha256], self.users[sha256]

    def forget_failed(self, hashes: Sequence[str]) -> None:
        """Drop contents that no worker could keep: they would fail every later task."""
        for sha256 in hashes:
            future = self.kept.get(sha256)
            if future is not None and future.status == "error":
                del self.kept[sha256]
                self.seen.pop(sha256, None)

    def clear(self) -> None:
        self.kept.clear()
        self.seen.clear()
        self.users.clear()


def check_all(client: Client, ours: _worker.WorkerPlatform) -> None:
    """Raise InputError if workers could give other digits; the scheduler computes nothing."""
    try:
        # The scheduler unpacks messages, so it needs the same packages.
        scheduler = client.run_on_scheduler(_worker.versions)
    except Exception as error:
        scheduler = error
    if scheduler != ours.versions:
        raise _worker.other_version("The scheduler", _worker.named(scheduler), ours.versions)
    for worker, theirs in client.run(_worker.this_computer, on_error="return").items():
        if theirs != ours:
            raise _worker.refusal(f"Worker {worker}", theirs, ours)


def has_workers(client: Client) -> bool:
    """Return whether there is a worker; False also without an answer."""
    with contextlib.suppress(Exception):
        return bool(client.nthreads())
    return False


_CONNECT_S = 15.0
_BACK_S = 120.0
"""s: tolerated absence of a scheduler, and of all its workers."""
_LOOK_S = 1.0
_AHEAD = 2
"""Open tasks per worker thread: one is done while the next arrives."""
_LOSSES = 3
"""Tolerated losses of the scheduler between two answers."""
_BUNDLE_S, _LARGEST = 0.4, 8
"""Shorter tasks are bundled up to this number: a millisecond costs overhead as a minute does."""
_BUNDLE_BYTES = 32_000_000
"""Larger things are not bundled: short ones may be followed by a job of gigabytes."""
_OPEN_BYTES = 1_000_000_000
"""Limit of bytes in open tasks, all held by client and scheduler."""


@dataclass(slots=True)
class _Open:
    """A submitted task with its things and bytes."""

    places: tuple[int, ...]
    future: Future
    hashes: tuple[str, ...]
    size: int


def end_client(client: Client, timeout_s: float) -> None:
    """Close a client, also one that lost its scheduler while reconnecting.

    Dask's own close waits for the listener and raises its error (a `ValueError` was seen) before
    closing anything: the client's thread would remain, and raise again at exit.
    """
    with contextlib.suppress(Exception):
        client.close(timeout=timeout_s)
    if client.status != "closed":
        client._handle_report_task = None  # noqa: SLF001 - it has failed and tells nothing any more
        with contextlib.suppress(Exception):
            client.close(timeout=timeout_s)


@dataclass(slots=True)
class Tasks:
    """Tasks of one call."""

    connect: Callable[[float], Client]
    """Returns a client within a time limit, s."""
    address: str
    work: Callable[..., Any]
    things: Sequence[Any]
    named: Callable[[Any], str]
    contents: Callable[[Any], Sequence[bytes]]
    on_done: Callable[[int], None]
    open: dict[str, _Open] = field(default_factory=dict)
    kept: TaskContents = field(default_factory=TaskContents)
    begun: int = 0
    """Number of things submitted at least once."""
    alone: deque[int] = field(default_factory=deque)
    """Indices to submit alone, first: of a failed bundle, and open when the scheduler was lost."""
    suspects: deque[int] = field(default_factory=deque)
    """Indices to submit alone: a worker that ended took innocent waiting tasks with it."""
    asked_alone: set[int] = field(default_factory=set)
    """Those that were: if a worker ends then, they are the cause."""
    thing_s: float = math.inf
    done: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)

    def run(self) -> Iterator[Any]:
        """Yield the answers in the order of the things."""
        found: dict[int, Any] = {}
        given = losses = done = taken = 0
        ours = _worker.this_computer()
        client = self._connected(ours)
        try:
            room = self._room(client)
            self.on_done(0)
            while given < len(self.things):
                while places := self._following(room):
                    failed = self._submit(client, places, ours)
                    found |= failed
                    for _ in failed:
                        done += 1
                        self.on_done(done)
                while given in found:
                    yield found.pop(given)
                    given += 1
                if not self.open:
                    continue
                key = self._next(client)
                if key is None:
                    losses += 1
                    if losses > _LOSSES:
                        raise StorageError(
                            "cluster.lost",
                            f"The scheduler {self.address} was lost several times before one more "
                            "task was done.",
                            "Look at its log, then run this again: nothing was stored.",
                        )
                    client = self._again(client, ours)
                    continue
                answered = self._result(key)
                if answered is None:
                    continue
                if isinstance(answered, _worker.Refused):
                    raise _worker.refusal("A worker", answered.computer, ours)
                found |= answered
                losses = 0
                for _ in answered:
                    done += 1
                    self.on_done(done)
                taken += 1
                room = self._room(client) if taken % 16 == 0 else room
        finally:
            for one in self.open.values():
                with contextlib.suppress(Exception):
                    one.future.cancel()
            self.open.clear()
            self.kept.clear()
            end_client(client, 5.0)

    def _connected(self, ours: _worker.WorkerPlatform) -> Client:
        client = self.connect(_CONNECT_S)
        try:
            try:
                client.wait_for_workers(1, timeout=_BACK_S)
            except TimeoutError as error:
                raise self._no_workers(_BACK_S) from error
            check_all(client, ours)
        except BaseException:
            end_client(client, 5.0)
            raise
        return client

    def _room(self, client: Client) -> int:
        """Return the number of tasks that may be open, by the current workers."""
        with contextlib.suppress(Exception):
            return max(_AHEAD * int(sum(client.nthreads().values())), _AHEAD)
        return _AHEAD

    def _following(self, room: int) -> Sequence[int]:
        """Return the next indices to submit, empty to wait; smaller bundles towards the end."""
        is_alone = any(one.places[0] in self.asked_alone for one in self.open.values())
        is_full = sum(one.size for one in self.open.values()) > _OPEN_BYTES
        if len(self.open) >= room or is_alone or is_full or (self.suspects and self.open):
            return ()
        if self.suspects:
            self.asked_alone.add(self.suspects[0])
            return (self.suspects.popleft(),)
        if self.alone:
            return (self.alone.popleft(),)
        left = len(self.things) - self.begun
        if not left:
            return ()
        together = min(int(_BUNDLE_S / max(self.thing_s, 1e-6)), _LARGEST, left // (2 * room))
        return range(self.begun, self.begun + max(together, 1))

    def _submit(
        self, client: Client, places: Sequence[int], ours: _worker.WorkerPlatform
    ) -> dict[int, OcmmError]:
        """Submit a task for the first of some things; return those that cannot be."""
        failed: dict[int, OcmmError] = {}
        asked: list[_worker.TaskRequest] = []
        handed: list[bytes | Future] = []
        taken: list[int] = []
        size = 0
        for place in places:
            if size > _BUNDLE_BYTES:
                break
            thing = self.things[place]
            name = self.named(thing)
            self.begun = max(self.begun, place + 1)
            try:
                contents = tuple(self.contents(thing))
            except Exception as error:
                failed[place] = contained(error, name)
                continue
            hashes, given = self.kept.hand(client, contents)
            size += sum(len(one) for one in given if isinstance(one, bytes))
            asked.append(_worker.TaskRequest(thing, name, hashes))
            handed += given
            taken.append(place)
        if not asked:
            return failed
        key = f"ocmm-{uuid.uuid4().hex}"
        future = client.submit(_worker.do, ours, self.work, asked, *handed, key=key, pure=False)
        hashes = tuple(sha256 for one in asked for sha256 in one.hashes)
        self.open[key] = _Open(tuple(taken), future, hashes, size)
        done = self.done
        future.add_done_callback(lambda _, key=key: done.put(key))
        return failed

    def _next(self, client: Client) -> str | None:
        """Return the key of a finished task; None if the scheduler was lost."""
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
            if waited > 5.0 and not has_workers(client):
                if waited > _BACK_S:
                    raise self._no_workers(waited)
            elif waited > 5.0:
                since = time.monotonic() - 5.0

    def _result(self, key: str) -> dict[int, Any] | _worker.Refused | None:
        """Return the answers of a task by index; None to repeat it."""
        one = self.open[key]
        answers: dict[int, Any] = {}
        try:
            done: _worker.Done | _worker.Refused = one.future.result(timeout=_BACK_S)
            if isinstance(done, _worker.Refused):
                return done
            answers = dict(zip(one.places, done.answers, strict=True))
            self.thing_s = done.seconds / len(one.places)
        except KilledWorker:
            if len(one.places) > 1 or one.places[0] not in self.asked_alone:
                # The cause among the bundled things is found by trying each alone.
                self.suspects.extend(one.places)
            else:
                answers = {place: self._died(self._name(place)) for place in one.places}
        except Exception as error:
            if one.future.status in ("cancelled", "lost", "pending"):
                # Finished, but its worker was lost before the answer came; Dask repeats it, or the
                # scheduler is gone, which the next poll detects.
                one.future.add_done_callback(lambda _: self.done.put(key))
                return None
            if len(one.places) > 1:
                # E.g. one of the answers cannot be sent, which is no fault of the others.
                self.alone.extend(one.places)
            else:
                answers = {place: contained(error, self._name(place)) for place in one.places}
        del self.open[key]
        self.kept.forget_failed(one.hashes)
        self.kept.give_back(one.hashes)
        return answers

    def _no_workers(self, seconds: float) -> StorageError:
        return StorageError(
            "cluster.no_workers",
            f"The scheduler {self.address} had no worker for {seconds:.0f} s.",
            "Start workers (docs/integrator/cluster.md), then run this again.",
        )

    def _died(self, name: str) -> OcmmError:
        return InternalError(
            "cluster.died",
            f"{name} ended every worker that tried it; their memory may be too small.",
            "Compute it here, or start workers with more memory.",
        )

    def _name(self, place: int) -> str:
        return self.named(self.things[place])

    def _again(self, client: Client, ours: _worker.WorkerPlatform) -> Client:
        """Return a new client with all open tasks resubmitted."""
        end_client(client, 2.0)
        # Contents are read again; a failure to do so becomes the answer.
        self.alone.extend(sorted(place for one in self.open.values() for place in one.places))
        self.asked_alone.clear()
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
