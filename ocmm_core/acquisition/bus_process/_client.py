"""Clients of the bus process: start, stop, and reason for stopping; as a child, or as a service.

On a measuring cell's computer systemd starts the bus process (``installer/linux``) with rights that
no person has. Its socket gives permitted users a bus process with the protocol of pipes. An
unprivileged relay process adapts it: a child process with the output of the service.
"""

from __future__ import annotations

import contextlib
import os
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from ocmm_core.acquisition.bus_process._commands import LineBuffer
from ocmm_core.acquisition.bus_process._launch import BusConfig, bus_command
from ocmm_core.acquisition.bus_process._remote_objects import ObjectLine
from ocmm_core.acquisition.frames import (
    AcquisitionState,
    FrameRing,
    RingHeaderField,
    StopReason,
    leave_error,
)
from ocmm_core.errors import AcquisitionError, BusError
from ocmm_core.failure import EXIT_FAILED, EXIT_INTERNAL, REOPEN, contained, exit_with

_KILL_S = 2.0
_SEND_S = 2.0
_READ_BYTES = 65536


class Acquisition(Protocol):
    """Fills a ring, in a thread or a process."""

    def start(self) -> None:
        """Start; later errors are reported in the ring."""
        ...

    def request_stop(self) -> None:
        """Request the end; returns at once."""
        ...

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came in time."""
        ...


class ChildProcess:
    """A process that fills a ring; its open standard input takes JSON requests, its end ends it."""

    def __init__(self, command: Sequence[str], first_lines: bytes, ring: FrameRing) -> None:
        self._command = list(command)
        self._first_lines = first_lines
        self._ring = ring
        self._inherited: tuple[int, ...] = ()
        self._process: subprocess.Popen[bytes] | None = None
        self._watch: threading.Thread | None = None
        self._stop_asked = False
        self._objects = ObjectLine()
        self._sending = threading.Lock()
        self._fed = threading.Event()
        self._cut = False

    @property
    def pid(self) -> int | None:
        """Return the process id, or None before the start."""
        return None if self._process is None else self._process.pid

    @property
    def objects(self) -> ObjectLine:
        """Return the pending object requests; see `RemoteObjects`."""
        return self._objects

    def start(self) -> None:
        """Start the process; raise BusError on failure."""
        if self._process is not None:
            raise AcquisitionError(
                "acquisition.started", "The acquisition is already started.", "Make a new one."
            )
        self._ring.set_word(RingHeaderField.STATE, AcquisitionState.OPENING)
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=subprocess.PIPE, pass_fds=self._inherited,
            )  # fmt: skip
        except OSError as error:
            raise BusError(
                "bus.start",
                f"'{self._command[0]}' cannot be started ({error.strerror}).",
                "Install the program completely.",
            ) from error
        self._watch = threading.Thread(
            target=self._watch_over, args=(self._process,), name="ocmm-bus-watch"
        )
        self._watch.start()

    def request_stop(self) -> None:
        """Ask the process to end after its present cycle."""
        self._stop_asked = True
        self._ring.set_word(RingHeaderField.STOP_REQUEST, 1)

    def close_input(self) -> None:
        """Close the process's input, as if this program had ended; no more requests."""
        if self._process is not None and self._process.stdin is not None:
            with self._sending, contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end, killing after the limit; return whether it ended in time."""
        if self._process is None or self._watch is None:
            return True
        self._watch.join(timeout_s)
        in_time = not self._watch.is_alive()
        if not in_time:
            self._process.kill()
            self._watch.join(_KILL_S)
        return in_time

    def send(self, line: bytes) -> None:
        """Send a line to the process; raise BusError if it is gone or blocked."""
        process = self._process
        if process is None or process.stdin is None:
            raise _gone("is not started")
        deadline = time.monotonic() + _SEND_S
        if not self._fed.wait(_SEND_S):
            raise _gone("takes nothing")
        with self._sending:
            if process.stdin.closed:
                raise _gone("has ended")
            if self._cut:
                raise _gone("takes nothing")
            rest = memoryview(line)
            while rest:
                left = max(0.0, deadline - time.monotonic())
                if not select.select([], [process.stdin], [], left)[1]:
                    # A partial line may be in transit; nothing after it would be understood.
                    self._cut = len(rest) < len(line)
                    raise _gone("takes nothing")
                try:
                    rest = rest[os.write(process.stdin.fileno(), rest) :]
                except BrokenPipeError:
                    raise _gone("has ended") from None

    def _watch_over(self, process: subprocess.Popen[bytes]) -> None:
        try:
            self._until_end(process)
        except Exception as error:
            # An unwatched process must not continue to fill the ring.
            process.kill()
            process.wait()
            leave_error(self._ring, error)
            self._ring.set_word(RingHeaderField.STOP_REASON, StopReason.FAILED)
            self._ring.set_word(RingHeaderField.STATE, AcquisitionState.STOPPED)
            self._objects.end(_gone("has ended"))

    def _until_end(self, process: subprocess.Popen[bytes]) -> None:
        if process.stdin is None or process.stdout is None or process.stderr is None:
            return
        # A process that ended at once reports why in its last output.
        with self._sending:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(self._first_lines)
                process.stdin.flush()
            os.set_blocking(process.stdin.fileno(), False)
        self._fed.set()
        answers = threading.Thread(
            target=self._read_answers, args=(process.stdout.fileno(),), name="ocmm-bus-answers"
        )
        answers.start()
        complaint = ""
        for line in process.stderr:
            text = line.decode("utf-8", errors="replace").strip()
            if text and not text.startswith("note: "):
                complaint = text
        code = process.wait()
        answers.join()
        process.stdout.close()
        process.stderr.close()
        self.close_input()
        if self._ring.word(RingHeaderField.STATE) == AcquisitionState.STOPPED:
            return
        if code and not (self._stop_asked and code < 0):
            self._ring.set_text(complaint or f"The bus process ended unexpectedly (code {code}).")
            self._ring.set_word(RingHeaderField.INTERNAL, int(code == EXIT_INTERNAL))
            self._ring.set_word(RingHeaderField.STOP_REASON, StopReason.FAILED)
        else:
            self._ring.set_word(RingHeaderField.STOP_REASON, StopReason.REQUESTED)
        self._ring.set_word(RingHeaderField.STATE, AcquisitionState.STOPPED)

    def _read_answers(self, descriptor: int) -> None:
        end = _gone("has ended")
        try:
            lines = LineBuffer()
            while content := os.read(descriptor, _READ_BYTES):
                for line in lines.push(content):
                    self._objects.receive(line)
        except Exception as error:
            told = contained(error, "Reading from the bus process", remedy=REOPEN)
            end = BusError(told.code, told.what, told.remedy)
        self._objects.end(end)


def _gone(why: str) -> BusError:
    return BusError(
        "bus.process", f"The bus process {why}.", "Start the acquisition and repeat the request."
    )


class BusProcess(ChildProcess):
    """The program ``ocmm-acq`` on an interface of this computer."""

    def __init__(self, config: BusConfig, ring: FrameRing) -> None:
        super().__init__(bus_command(), config.to_json(), ring)


SERVICE_SOCKET = Path("/run/ocmm/acq.sock")
_RING_MODE = 0o660


class ServiceBus(ChildProcess):
    """The service ``ocmm-acq``, as an `Acquisition`.

    `config`: the interface is ignored: the service sets it. `ring`: the ring named in `config`;
    writable by the group of the service from `start` on.
    """

    def __init__(self, config: BusConfig, ring: FrameRing, address: Path = SERVICE_SOCKET) -> None:
        # -I as in `_launch.bus_command`.
        command = [sys.executable, "-I", "-m", "ocmm_core.acquisition.bus_process._client"]
        super().__init__([*command, str(address)], config.to_json(), ring)
        self._ring_path = ring.path
        self._address = address

    def start(self) -> None:
        """Connect to the service; raise BusError if it is absent or not permitted."""
        try:
            group = self._address.stat().st_gid
        except OSError as error:
            raise BusError(
                "bus.service_missing",
                f"No camera bus service at {self._address} ({error.strerror}).",
                "Start it (sudo systemctl start ocmm-acq.socket), or name the interface of the "
                "cameras as their source: ethercat:INTERFACE (Settings, Instrument).",
            ) from error
        try:
            shutil.chown(self._ring_path, group=group)
            self._ring_path.chmod(_RING_MODE)
        except OSError as error:
            raise _not_allowed(self._address) from error
        super().start()


def relay(address: str, source: int, sink: int) -> bool:
    """Relay `source` and `sink` until one ends; True if `source` first; BusError: unreachable."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as service:
        try:
            service.connect(address)
        except PermissionError as error:
            raise _not_allowed(Path(address)) from error
        except OSError as error:
            raise BusError(
                "bus.service_missing",
                f"The camera bus service does not answer ({error.strerror}).",
                "Check it (systemctl status ocmm-acq.socket); another window may be using it.",
            ) from error
        listened_to = [source, service.fileno()]
        while True:
            ready = select.select(listened_to, [], [])[0]
            if source in ready:
                content = os.read(source, _READ_BYTES)
                if content:
                    service.sendall(content)
                else:
                    # The bus process sees the end of its input, but may still send output.
                    service.shutdown(socket.SHUT_WR)
                    listened_to = [service.fileno()]
            if service.fileno() in ready:
                content = service.recv(_READ_BYTES)
                if not content:
                    return source not in listened_to
                _write(sink, content)


def main() -> None:
    """Run the relay: ``python -m ..._client SOCKET``."""
    try:
        ours = relay(sys.argv[1], sys.stdin.fileno(), sys.stdout.fileno())
    except (BrokenPipeError, ConnectionResetError):
        ours = False
    except Exception as error:
        exit_with(error, "The relay to the camera bus service", REOPEN)
    if not ours:
        sys.stderr.write(
            "The camera bus service ended or refused; another window may be using it. See its "
            "log: journalctl -u 'ocmm-acq@*' -n 20\n"
        )
        sys.exit(EXIT_FAILED)


def _write(sink: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(sink, rest) :]


def _not_allowed(address: Path) -> BusError:
    return BusError(
        "bus.service_denied",
        f"This user may not use the camera bus service at {address}.",
        "Join its group: sudo usermod -aG ocmm $USER, then log in again.",
    )


if __name__ == "__main__":
    main()
