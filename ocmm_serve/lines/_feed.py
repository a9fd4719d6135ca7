"""Feed of new points to a device that only receives: a serial line, or a keyboard."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import queue
import threading
import time
from collections.abc import Callable
from typing import Protocol

from ocmm_core.errors import InputError, MeasuringError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.plugins import install_line
from ocmm_core.station.stream import PlainLines, StepReader, StreamSource

MOST_WAITING = 100
"""Lines that wait for a device; more than a minute of touches."""
_STOP_S = 2.0


class Receiver(Protocol):
    """A device; used by one thread."""

    def send(self, line: bytes) -> None:
        """Send a line once; OcmmError if it may not have arrived."""
        ...

    def close(self) -> None: ...


class LineFeed:
    """Send each new point of a station once; a context manager.

    Points of an earlier start are not sent. `note`: receives sentences for the operator.
    """

    def __init__(
        self,
        source: StreamSource,
        plain: PlainLines,
        receiver: Receiver,
        note: Callable[[str], None],
    ) -> None:
        self._source, self._plain, self._receiver, self._note = source, plain, receiver, note
        self._steps = StepReader(source.job)
        self._lock = threading.Lock()
        self._lines: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._live = False
        self._until_s = math.inf
        self._thread = threading.Thread(target=self._run, name="ocmm-lines")

    def __enter__(self) -> LineFeed:
        # With priority: the next change may close the job that this one reads.
        self._source.events.changed.connect(self._on_change, priority=1)
        self._on_change()
        self._live = True
        self._thread.start()
        return self

    def __str__(self) -> str:
        return str(self._receiver)

    def __exit__(self, *_: object) -> None:
        self._source.events.changed.disconnect(self._on_change)
        # A device that takes nothing must not hold the program.
        self._until_s = time.monotonic() + _STOP_S
        with contextlib.suppress(queue.Full):
            self._lines.put_nowait(None)
        self._thread.join(2.0 * _STOP_S)
        self._receiver.close()

    def _on_change(self) -> None:
        try:
            with self._lock:
                for _, step in self._steps.read():
                    line = self._plain.line_of(step, live=self._live)
                    if line and self._live:
                        self._add(line)
        except Exception as error:
            self._note(str(contained(error, "The lines of points")))

    def _add(self, line: bytes) -> None:
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._note(f"{MOST_WAITING} points wait for the device; this one was not sent.")

    def _run(self) -> None:
        while (line := self._lines.get()) is not None and time.monotonic() < self._until_s:
            try:
                self._receiver.send(line)
            except Exception as error:
                told = error if isinstance(error, OcmmError) else contained(error, "The device")
                shown = line.decode("ascii").strip()
                self._note(f"Not sent, or in part: {shown}. {told.what} {told.remedy}")


class SerialReceiver:
    """A serial line, opened again after it was pulled out; InputError if it cannot be opened."""

    def __init__(self, device: str, baud: int = 9600) -> None:
        if importlib.util.find_spec("serial") is None:
            raise InputError(
                "lines.package",
                "A serial line needs a package that is not installed.",
                f"Install it: {install_line('sensors')}.",
            )
        import serial

        self._device = device
        try:
            # A receiver that reads nothing must not hold this program.
            self._line = serial.Serial(device, baud, write_timeout=_STOP_S)
        except (OSError, ValueError) as error:
            raise InputError(
                "lines.serial",
                f"The serial line {device} cannot be opened ({error}).",
                "Check name and cable; on Linux the user must be in the group of the device "
                "(often dialout).",
            ) from error

    def send(self, line: bytes) -> None:
        try:
            if not self._line.is_open:
                self._line.open()
            self._line.write(line)
            self._line.flush()
        except OSError as error:
            self._line.close()
            raise MeasuringError(
                "lines.serial_lost",
                f"The serial line {self._device} did not take it ({error}).",
                "Check cable and receiver, then touch this point again.",
            ) from error

    def close(self) -> None:
        self._line.close()

    def __str__(self) -> str:
        return f"{self._line.port}, {self._line.baudrate} baud"
