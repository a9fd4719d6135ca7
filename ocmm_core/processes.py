"""The same work on many things side by side, in processes that are gone when they should be.

A process ends with the one that started it, also where that was killed. What goes between them goes
through the pipes of `multiprocessing`; nothing of it is ever in a file.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext, SpawnContext
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from typing import NoReturn, TypeVar

from ocmm_core.blas import use_one_thread
from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.leftovers import scratch_folder

T = TypeVar("T")
R = TypeVar("R")

_FEW = 16
"""So many jobs take as long one after the other as the start of two processes and the half of them:
a process loads its libraries for about a second, a job of 91 points takes a tenth of one."""
_END_S = 1.0
_MOST_FILES = 1 << 16


def processes_for(things: int) -> int:
    """Return in how many processes so many things are worked on: one a core at most.

    It is 1, which is the process that asks, where the start of others takes longer than they save,
    or where this one may not start any (a daemon of `multiprocessing`).
    """
    if things <= _FEW or multiprocessing.current_process().daemon:
        return 1
    return HOST.processors()


def process_context() -> SpawnContext | ForkServerContext:
    """Return how a process beside this one is started: anew, which takes a second to load.

    Who starts many tells `multiprocessing` to make them from a server that has loaded it once
    (``set_start_method("forkserver")``, ``set_forkserver_preload``); each is still a process of its
    own that may end as it likes. It has the environment of the server.
    """
    if multiprocessing.get_start_method(allow_none=True) == "forkserver":
        return multiprocessing.get_context("forkserver")
    return multiprocessing.get_context("spawn")


def side_by_side(
    work: Callable[[T], R],
    things: Sequence[T],
    processes: int,
    named: Callable[[T], str],
    told: Callable[[int], None] = lambda done: None,
) -> Iterator[R | OcmmError]:
    """Yield the answers for all things, in their order, whichever is done first.

    A caller that closes this generator, or leaves it by an exception, ends the processes within a
    second each, whatever they do. ``work`` on one thing is a function of a module, or a
    `functools.partial` of one. Its exception is the answer for that thing, and the others go on; so
    it is if its process dies. ``things`` and answers can be sent to another process; ``processes``:
    with 1 all is done in this one; ``named``: name of the work on a thing, as the beginning of a
    sentence: "The reading of a.ocmm"; ``told``: called with the number done.
    """
    if processes <= 1:
        for done, thing in enumerate(things):
            told(done)
            yield _answer(work, thing, named(thing))
        told(len(things))
        return
    # The processes inherit the environment; theirs is read before they load numpy.
    use_one_thread()
    with scratch_folder("side") as scratch:
        crew: list[_Hand] = []
        try:
            yield from _shared_out(crew, work, things, processes, named, told, str(scratch))
        finally:
            for hand in crew:
                hand.process.terminate()
            for hand in crew:
                hand.end()


def end_with_parent(may: Callable[[], bool] = lambda: True) -> None:
    """End this process as soon as its parent is gone, unless ``may``, called then, forbids it."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    sentinel = parent.sentinel

    def watch() -> None:
        wait([sentinel])
        if may():
            os._exit(1)

    threading.Thread(target=watch, name="ocmm-parent-watch", daemon=True).start()


class Aside:
    """Work of a copy of this process next to it; it ends with this one and the starting thread.

    A copy has all that this process holds, also what cannot be sent, such as objects of C++, but no
    threads. What it sends waits there for this process, and the work continues meanwhile. ``work``
    is given what sends bytes to this process.
    """

    def __init__(self, work: Callable[[Callable[[bytes], None]], None]) -> None:
        self._pid = 0
        self._pipe: Connection | None = None
        if not HOST.can_copy_process():
            return
        ours, theirs = multiprocessing.Pipe(duplex=False)
        try:
            self._pid = HOST.copy_process()
        except OSError:
            ours.close()
            theirs.close()
            return
        if not self._pid:
            _work_aside(work, theirs)
        theirs.close()
        self._pipe = ours

    def next(self, limit_s: float) -> bytes | None:
        """Wait for the next bytes of the work; None at its end, for any reason.

        After ``limit_s`` of processor time it is ended.
        """
        if self._pipe is None:
            return None
        try:
            while not self._pipe.poll(_END_S):
                took = HOST.processor_seconds(self._pid)
                if took is None or took > limit_s:
                    self.end()
                    return None
            return self._pipe.recv_bytes()
        except (EOFError, OSError):
            self.end()
            return None

    def end(self) -> None:
        """End the work, whatever it does."""
        if self._pipe is None:
            return
        self._pipe.close()
        self._pipe = None
        HOST.end_copy(self._pid)


def _work_aside(work: Callable[[Callable[[bytes], None]], None], pipe: Connection) -> NoReturn:
    """Work in the copy, and never come back to what the other process does."""
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # Who reads from the other process must see its pipes end with it.
        os.closerange(3, pipe.fileno())
        os.closerange(pipe.fileno() + 1, _MOST_FILES)
        _work_and_send(work, pipe)
    except BaseException:
        # The other process does without, and says what is wrong.
        os._exit(1)
    os._exit(0)


def _work_and_send(work: Callable[[Callable[[bytes], None]], None], pipe: Connection) -> None:
    """Work, and send what it makes while it goes on: the other process may not listen yet."""
    made: SimpleQueue[bytes | None] = SimpleQueue()

    def send() -> None:
        try:
            while (content := made.get()) is not None:
                pipe.send_bytes(content)
        except OSError:
            # Nobody listens any more.
            os._exit(1)

    sender = threading.Thread(target=send, name="ocmm-aside-send")
    sender.start()
    try:
        work(made.put)
    finally:
        # What was made before a fault is sent as well.
        made.put(None)
        sender.join()


@dataclass(slots=True)
class _Hand:
    """A process, the pipe to it, and the place of the thing that it works on; -1 without one."""

    process: BaseProcess
    pipe: Connection
    place: int = -1

    def end(self) -> None:
        """Wait until the process is gone, and see to it."""
        self.pipe.close()
        self.process.join(_END_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()


def _shared_out(
    crew: list[_Hand],
    work: Callable[[T], R],
    things: Sequence[T],
    processes: int,
    named: Callable[[T], str],
    told: Callable[[int], None],
    scratch: str,
) -> Iterator[R | OcmmError]:
    found: dict[int, R | OcmmError] = {}
    begun = done = given = 0
    told(0)
    while given < len(things):
        while begun < len(things) and len(crew) < min(processes, len(things)):
            # Also in the place of one that died.
            crew.append(_hand(work, scratch))
            begun = _give_next(crew[-1], things, begun, named)
        for ready in wait([hand.pipe for hand in crew]):
            hand = next(one for one in crew if one.pipe is ready)
            place = hand.place
            try:
                found[place] = hand.pipe.recv()
            except (EOFError, OSError):
                found[place] = _died(named(things[place]))
                crew.remove(hand)
                hand.end()
            else:
                begun = _give_next(hand, things, begun, named)
                if hand.place < 0:
                    crew.remove(hand)
                    hand.end()
            done += 1
            told(done)
        while given in found:
            yield found.pop(given)
            given += 1


def _hand(work: Callable[[T], R], scratch: str) -> _Hand:
    context = process_context()
    ours, theirs = context.Pipe()
    process = context.Process(
        target=_serve, args=(work, theirs, scratch), name="ocmm-side", daemon=True
    )
    process.start()
    theirs.close()
    return _Hand(process, ours)


def _give_next(hand: _Hand, things: Sequence[T], begun: int, named: Callable[[T], str]) -> int:
    """Let a process work on the next thing, if there is one; return how many are begun."""
    hand.place = -1
    if begun == len(things):
        return begun
    hand.place = begun
    # Where it died just now, what is read from its pipe says so.
    with contextlib.suppress(OSError):
        hand.pipe.send((things[begun], named(things[begun])))
    return begun + 1


def _died(name: str) -> InternalError:
    return InternalError(
        "processes.died",
        f"{name} ended unexpectedly; the computer may be short of memory.",
        "Close other programs and try again.",
    )


def _serve(work: Callable[[T], R], pipe: Connection, scratch: str) -> None:
    """Work on what comes until nothing comes any more; what runs in the process."""
    end_with_parent()
    # Whoever started this one ends it; a key that interrupts goes to all of a terminal.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = scratch
    while True:
        try:
            thing, name = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(_answer(work, thing, name))


def _answer(work: Callable[[T], R], thing: T, name: str) -> R | OcmmError:
    try:
        return work(thing)
    except Exception as error:
        return contained(error, name)
