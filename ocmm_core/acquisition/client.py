"""The application's side of the bus process: start it, ask it to stop, learn why it ended."""

from __future__ import annotations

import contextlib
import subprocess
import threading
from collections.abc import Sequence
from typing import Protocol

from ocmm_core.acquisition.bus_config import BusConfig
from ocmm_core.acquisition.launch import bus_command
from ocmm_core.acquisition.ring import FrameRing, Word
from ocmm_core.acquisition.worker import AcquisitionState, StopReason
from ocmm_core.errors import AcquisitionError, BusError

_KILL_S = 2.0


class Acquisition(Protocol):
    """Something that fills a ring: a worker in a thread, or a process."""

    def start(self) -> None:
        """Begin; what goes wrong later is told by the ring."""
        ...

    def request_stop(self) -> None:
        """Ask for the end; returns at once."""
        ...

    def join(self, timeout_s: float) -> bool:
        """Wait for the end and say whether it came in time."""
        ...


class ChildProcess:
    """A process that fills a ring, fed with one line of JSON and watched until it ends.

    Parameters
    ----------
    command
        What to start.
    first_line
        What to write to its standard input, which then stays open: its end tells the process
        that this one is gone.
    ring
        The ring it fills; this process keeps it.
    """

    def __init__(self, command: Sequence[str], first_line: bytes, ring: FrameRing) -> None:
        self._command = list(command)
        self._first_line = first_line
        self._ring = ring
        self._process: subprocess.Popen[bytes] | None = None
        self._watch: threading.Thread | None = None
        self._stop_asked = False

    @property
    def pid(self) -> int | None:
        """Return the process number, or None before the start."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start the process.

        Raises
        ------
        BusError
            It cannot be started.
        """
        if self._process is not None:
            raise AcquisitionError(
                "acquisition.started", "The acquisition was started already.", "Make a new one."
            )
        self._ring.set_word(Word.STATE, AcquisitionState.OPENING)
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
        except OSError as error:
            raise BusError(
                "bus.start",
                f"'{self._command[0]}' cannot be started ({error.strerror}).",
                "Install the program completely.",
            ) from error
        self._watch = threading.Thread(
            target=self._until_end, args=(self._process,), name="ocmm-bus-watch"
        )
        self._watch.start()

    def request_stop(self) -> None:
        """Ask the process to end after its present cycle."""
        self._stop_asked = True
        self._ring.set_word(Word.STOP_REQUEST, 1)

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; a process that does not end in time is killed.

        Returns
        -------
        bool
            True where it ended by itself in time.
        """
        if self._process is None or self._watch is None:
            return True
        self._watch.join(timeout_s)
        in_time = not self._watch.is_alive()
        if not in_time:
            self._process.kill()
            self._watch.join(_KILL_S)
        return in_time

    def _until_end(self, process: subprocess.Popen[bytes]) -> None:
        """Feed the process, wait for its end and leave the reason in the ring."""
        if process.stdin is None or process.stderr is None:
            return
        # A process that ended at once says why in its last words.
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(self._first_line)
            process.stdin.flush()
        complaint = ""
        for line in process.stderr:
            text = line.decode("utf-8", errors="replace").strip()
            if text and not text.startswith("note: "):
                complaint = text
        code = process.wait()
        process.stderr.close()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        if self._ring.word(Word.STATE) == AcquisitionState.STOPPED:
            return
        if code and not (self._stop_asked and code < 0):
            self._ring.set_text(complaint or f"The bus process ended unexpectedly (code {code}).")
            self._ring.set_word(Word.STOP_REASON, StopReason.FAILED)
        else:
            self._ring.set_word(Word.STOP_REASON, StopReason.REQUESTED)
        self._ring.set_word(Word.STATE, AcquisitionState.STOPPED)


class BusProcess(ChildProcess):
    """The program ``ocmm-acq`` on an interface of this computer.

    Parameters
    ----------
    config
        What to do there.
    ring
        The ring named in it.
    """

    def __init__(self, config: BusConfig, ring: FrameRing) -> None:
        super().__init__(bus_command(), config.to_json(), ring)
