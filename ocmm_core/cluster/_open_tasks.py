"""The tasks that are open: which are given out, which are done, which go out again.

The computer that asks keeps what every open task needs, and never has more than a few tasks a
worker open: neither the scheduler nor this one holds all jobs at once. A lost worker is Dask's
matter, which does its tasks again; a lost scheduler is ours: the open tasks are given to it anew
when it is back.

What a scheduler is asked beside its tasks.
"""

from __future__ import annotations

import contextlib
import math
import queue
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from distributed import Client, Future, KilledWorker

from ocmm_core.cluster._contents import Contents
from ocmm_core.cluster._sentences import (
    died,
    no_workers,
    other_processor,
    other_version,
    scheduler_lost,
)
from ocmm_core.cluster._worker import Asked, Computer, Done, Refused, do, this_computer, versions
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.failure import contained


def check_all(client: Client, ours: Computer) -> None:
    """Raise InputError where the scheduler or a worker could give other digits.

    The scheduler computes nothing: its processor may be any.
    """
    scheduler = _of_scheduler(client)
    if scheduler != ours.versions:
        raise other_version("The scheduler", _named(scheduler), ours.versions)
    for worker, theirs in client.run(this_computer, on_error="return").items():
        if theirs != ours:
            raise refusal(f"Worker {worker}", theirs, ours)


def refusal(who: str, theirs: object, ours: Computer) -> InputError:
    """Return why a worker that is not like this computer could give other digits."""
    if not isinstance(theirs, Computer):
        # One that knows no such thing is of another version.
        return other_version(who, _named(theirs), ours.versions)
    if theirs.versions != ours.versions:
        return other_version(who, theirs.versions, ours.versions)
    there = theirs.arithmetic.environment_of(ours.arithmetic)
    here = ours.arithmetic.environment_of(theirs.arithmetic)
    return other_processor(who, str(theirs.arithmetic), str(ours.arithmetic), there, here)


def _named(found: object) -> str:
    return found if isinstance(found, str) else f"another version ({type(found).__name__})"


def _of_scheduler(client: Client) -> object:
    # It unpacks what it hands on, so it needs the same packages.
    try:
        return client.run_on_scheduler(versions)
    except Exception as error:
        return error


def has_workers(client: Client) -> bool:
    """Return whether a worker is there; False also where nobody says so."""
    with contextlib.suppress(Exception):
        return bool(client.nthreads())
    return False


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
_BUNDLE_BYTES = 32_000_000
"""What needs more goes by itself: short things may be followed by a job of gigabytes."""
_OPEN_BYTES = 1_000_000_000
"""So much may be on its way with open tasks: this computer and the scheduler hold all of it."""


@dataclass(slots=True)
class _Open:
    """A task that was given out, about one thing or some, and the bytes that went with it."""

    places: tuple[int, ...]
    future: Future
    hashes: tuple[str, ...]
    size: int


def end_client(client: Client, timeout_s: float) -> None:
    """Close a client, also one that has lost its scheduler while it connected anew.

    Dask's own way to close waits for what listens to the scheduler and raises what that failed with
    (a `ValueError` was seen), before anything is closed: the thread of the client would stay, and
    its end would raise that once more.
    """
    with contextlib.suppress(Exception):
        client.close(timeout=timeout_s)
    if client.status != "closed":
        client._handle_report_task = None  # noqa: SLF001 - it has failed and tells nothing any more
        with contextlib.suppress(Exception):
            client.close(timeout=timeout_s)


@dataclass(slots=True)
class Tasks:
    """The tasks of one call."""

    connect: Callable[[float], Client]
    """Makes a client within so many seconds."""
    address: str
    work: Callable[..., Any]
    things: Sequence[Any]
    named: Callable[[Any], str]
    contents: Callable[[Any], Sequence[bytes]]
    told: Callable[[int], None]
    open: dict[str, _Open] = field(default_factory=dict)
    kept: Contents = field(default_factory=Contents)
    begun: int = 0
    """So many have been given out at least once."""
    alone: deque[int] = field(default_factory=deque)
    """Places that are given out one by one, before those that have not been: of a task about
    several that failed as a whole, and of those that were open when the scheduler went."""
    suspects: deque[int] = field(default_factory=deque)
    """Places that are given out while nothing else is open: a worker that ended took with it also
    what only waited there."""
    asked_alone: set[int] = field(default_factory=set)
    """Those of them that were: what ends a worker then ends it by itself."""
    thing_s: float = math.inf
    """How long one thing takes."""
    done: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)

    def run(self) -> Iterator[Any]:
        """Give the answers in the order of the things."""
        found: dict[int, Any] = {}
        given = losses = done = taken = 0
        ours = this_computer()
        client = self._connected(ours)
        try:
            room = self._room(client)
            self.told(0)
            while given < len(self.things):
                while places := self._following(room):
                    failed = self._give(client, places, ours)
                    found |= failed
                    for _ in failed:
                        done += 1
                        self.told(done)
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
                    raise refusal("A worker", answered.computer, ours)
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
            end_client(client, 5.0)

    def _connected(self, ours: Computer) -> Client:
        client = self.connect(_CONNECT_S)
        try:
            self._wait_for_workers(client)
            check_all(client, ours)
        except BaseException:
            end_client(client, 5.0)
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

    def _following(self, room: int) -> Sequence[int]:
        """Return what may be given out next, none where it has to wait.

        Fewer go together towards the end, for all workers.
        """
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

    def _give(self, client: Client, places: Sequence[int], ours: Computer) -> dict[int, OcmmError]:
        """Give a task out about the first of some things; return why some of it cannot be."""
        failed: dict[int, OcmmError] = {}
        asked: list[Asked] = []
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
            asked.append(Asked(thing, name, hashes))
            handed += given
            taken.append(place)
        if not asked:
            return failed
        key = f"ocmm-{uuid.uuid4().hex}"
        future = client.submit(do, ours, self.work, asked, *handed, key=key, pure=False)
        hashes = tuple(sha256 for one in asked for sha256 in one.hashes)
        self.open[key] = _Open(tuple(taken), future, hashes, size)
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
            if waited > 5.0 and not has_workers(client):
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
            if len(one.places) > 1 or one.places[0] not in self.asked_alone:
                # Which of those that were there it was is not known until each is tried alone.
                self.suspects.extend(one.places)
            else:
                answers = {place: died(self._name(place)) for place in one.places}
        except Exception as error:
            if one.future.status in ("cancelled", "lost", "pending"):
                # Done, but its worker went before the answer came; Dask does it again, or the
                # scheduler is gone, which the next look tells.
                one.future.add_done_callback(lambda _: self.done.put(key))
                return None
            if len(one.places) > 1:
                # An answer of one of them cannot be sent, say: no fault of the others.
                self.alone.extend(one.places)
            else:
                answers = {place: contained(error, self._name(place)) for place in one.places}
        del self.open[key]
        self.kept.forget_failed(one.hashes)
        self.kept.give_back(one.hashes)
        return answers

    def _name(self, place: int) -> str:
        return self.named(self.things[place])

    def _again(self, client: Client, ours: Computer) -> Client:
        """Return a new client with all open tasks given out anew."""
        end_client(client, 2.0)
        # What could be read before is read again; where it cannot be any more, that is the answer.
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
