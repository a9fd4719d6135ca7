"""Parallel work in processes that end with the one that started them, also if it is killed.

Data are exchanged through pipes of `multiprocessing`, never through files.
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
from ocmm_core.cleanup import scratch_folder
from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.host import HOST

T = TypeVar("T")
R = TypeVar("R")
Tell = Callable[[str, float], None]
"""Receives the next step, and the share done."""

_FEW = 16
"""Up to so many jobs, two processes save no time: they load for a second, a job takes 0.1 s."""
_END_S = 1.0
_LOOK_S = 0.05
_MOST_FILES = 1 << 16


def processes_for(things: int) -> int:
    """Return the number of processes for so many things: one a core at most.

    It is 1, the calling process, if others would save no time or cannot be started (a daemon of
    `multiprocessing`).
    """
    return 1 if things <= _FEW or multiprocessing.current_process().daemon else HOST.processors()


def process_context() -> SpawnContext | ForkServerContext:
    """Return the context of further processes: "spawn", which loads for a second.

    For many processes set "forkserver" as start method and preload it.
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
    """Yield the answers for all things, in their order.

    Closing this generator ends the processes within a second each. ``work``: a function of a
    module, or a `functools.partial` of one; if it raises, or its process dies, the error is the
    answer. ``things`` and answers are pickled; ``processes``: 1 is this one; ``named``: name of the
    work on a thing, at the start of a sentence; ``told``: called with the number done.
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
    """Work of a fork of this process; it ends with this one and the starting thread.

    A fork has all objects of this process, also those of C++, but no threads. ``work`` is given a
    function that sends bytes to this process, and continues while they wait there.
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
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # Readers of the other process must see its pipes end with it.
        os.closerange(3, pipe.fileno())
        os.closerange(pipe.fileno() + 1, _MOST_FILES)
        _work_and_send(work, pipe)
    except BaseException:
        os._exit(1)
    os._exit(0)


def _work_and_send(work: Callable[[Callable[[bytes], None]], None], pipe: Connection) -> None:
    """Work, and send results meanwhile: the other process may not listen yet."""
    made: SimpleQueue[bytes | None] = SimpleQueue()

    def send() -> None:
        try:
            while (content := made.get()) is not None:
                pipe.send_bytes(content)
        except OSError:
            os._exit(1)

    sender = threading.Thread(target=send, name="ocmm-aside-send")
    sender.start()
    try:
        work(made.put)
    finally:
        made.put(None)
        sender.join()


def run_elsewhere(
    work: Callable[[Tell], R],
    part: str,
    given_up: Callable[[], bool],
    cancelled: OcmmError,
    died: OcmmError,
    tell: Tell = lambda what, share: None,
) -> R:
    """Return the answer of a function of a module from another process.

    ``given_up`` is polled 20 times a second and obeyed in two: raises ``cancelled``. Raises
    ``died`` if the process ends without an answer, and errors of the work (of this ``part``).
    """
    # The child reads this before it imports numpy.
    use_one_thread()
    context = process_context()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(
        target=_answer_once, args=(work, part, sender), name="ocmm-elsewhere", daemon=True
    )
    process.start()
    sender.close()
    try:
        while True:
            if given_up():
                raise cancelled
            if not receiver.poll(_LOOK_S):
                continue
            said = receiver.recv()
            if isinstance(said, _Step):
                tell(said.what, said.share)
            elif isinstance(said, OcmmError):
                raise said
            else:
                answer: R = said
                return answer
    except EOFError as error:
        raise died from error
    finally:
        process.terminate()
        end_process(process)
        receiver.close()


def _answer_once(work: Callable[[Tell], R], part: str, sender: Connection) -> None:
    said: R | OcmmError
    try:
        said = work(lambda what, share: sender.send(_Step(what, share)))
    except Exception as error:
        said = contained(error, part)
    sender.send(said)
    sender.close()


def end_process(process: BaseProcess) -> None:
    """Await the end of a process for a second, then kill it; release it."""
    process.join(_END_S)
    if process.is_alive():
        process.kill()
        process.join()
    # A process that started meanwhile also reaps ended ones, and may have been first.
    with contextlib.suppress(ValueError):
        process.close()


@dataclass(frozen=True, slots=True)
class _Step:
    what: str
    share: float


@dataclass(slots=True)
class _Hand:
    """A process, the pipe to it, and the place of the thing that it works on; -1 without one."""

    process: BaseProcess
    pipe: Connection
    place: int = -1

    def end(self) -> None:
        self.pipe.close()
        end_process(self.process)


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
    """Give a process the next thing, if any; return how many are started."""
    hand.place = -1
    if begun == len(things):
        return begun
    hand.place = begun
    # If it has died, its pipe returns that later.
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
    """Run in a process: answer each thing until the pipe is closed."""
    end_with_parent()
    # The parent ends this process; Ctrl+C goes to all of a terminal.
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
