"""A station that runs until Ctrl-C, and the feed of its points to a device that only receives.

The device is a serial line, or a wedge that types into the program with the keyboard focus.
"""

from __future__ import annotations

import contextlib
import importlib.util
import math
import os
import queue
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from ocmm_cli.terminal import lead, make_console
from ocmm_core.composition import StationRequest
from ocmm_core.errors import InputError, MeasuringError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.plugins import install_line
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import PlainLines, StepReader, StreamSource
from ocmm_serve.lines._template import LineTemplate
from ocmm_serve.site import measure_until, serving, stop_event

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


Note = Callable[[str], None]
Face = Callable[[MeasuringStation, PlainLines, Note], AbstractContextManager[object]]
"""Connects the lines of a station to their destination; its text names that."""


def run(request: StationRequest, template: LineTemplate, end: bytes, face: Face) -> None:
    """Measure until Ctrl-C or the end of the source; OcmmError if the station fails."""
    console = make_console(soft_wrap=True)
    ended = stop_event()

    def note(words: str) -> None:
        console.show(words, style="yellow")

    plain = PlainLines(lambda one: template.line(one).encode("ascii") + end, note)
    with serving(request, console) as built, face(built.station, plain, note) as made:
        console.show(template.summary)
        console.print(f"{lead('Lines   ')}{made}")
        measure_until(built.station, ended)


_LIMIT_S = 5.0
"""s: a line is typed in some 0.1 s."""


@dataclass(frozen=True, slots=True)
class TypingTool:
    """A program that presses keys."""

    name: str
    type_text: tuple[str, ...]
    tab: tuple[str, ...]
    enter: tuple[str, ...]
    """`type_text`, `tab`, `enter`: arguments before a text, and of these keys."""


_XDOTOOL = TypingTool(
    "xdotool", ("type", "--clearmodifiers", "--delay", "2", "--"), ("key", "Tab"), ("key", "Return")
)
_WTYPE = TypingTool("wtype", ("--",), ("-k", "Tab"), ("-k", "Return"))
# Codes of the kernel, pressed and released.
_YDOTOOL = TypingTool("ydotool", ("type", "--"), ("key", "15:1", "15:0"), ("key", "28:1", "28:0"))


def find_tool(environment: Mapping[str, str] = os.environ) -> TypingTool:
    """Return the program that types in this desktop session; InputError: the missing one."""
    wayland = bool(environment.get("WAYLAND_DISPLAY"))
    if not wayland and not environment.get("DISPLAY"):
        raise InputError(
            "keyboard.display",
            "There is no desktop session to type into (neither DISPLAY nor WAYLAND_DISPLAY).",
            "Start the command in a terminal of the desktop; on Windows use ocmm serve lines.",
        )
    tools = (_WTYPE, _YDOTOOL) if wayland else (_XDOTOOL,)
    for tool in tools:
        if shutil.which(tool.name, path=environment.get("PATH")):
            return tool
    names = " or ".join(tool.name for tool in tools)
    raise InputError(
        "keyboard.tool",
        f"Typing into other programs needs {names}, which is not installed.",
        f"Install it: apt install {tools[0].name}",
    )


class KeyboardReceiver:
    """Type lines. `window`: words in the title of the only window to type into; empty: any."""

    def __init__(self, tool: TypingTool, window: str = "") -> None:
        if window and tool is not _XDOTOOL:
            raise InputError(
                "keyboard.window",
                f"{tool.name} cannot read the title of the active window.",
                "Leave --window away, or use a desktop session of X11 with xdotool.",
            )
        self._tool, self._window = tool, window
        # Absolute: the folder of the command may hold another program of this name.
        self._program = shutil.which(tool.name) or tool.name

    def send(self, line: bytes) -> None:
        self._check_window()
        for piece in re.findall(r"[\t\n]|[^\t\n]+", line.decode("ascii")):
            keys = {"\t": self._tool.tab, "\n": self._tool.enter}
            self._call(keys.get(piece) or (*self._tool.type_text, piece))

    def close(self) -> None:
        """Do nothing; no key is held."""

    def __str__(self) -> str:
        return f'window "{self._window}"' if self._window else "active window"

    def _check_window(self) -> None:
        if not self._window:
            return
        title = self._call(["getactivewindow", "getwindowname"])
        if self._window.casefold() not in title.casefold():
            raise MeasuringError(
                "keyboard.other_window",
                f'The active window is "{title.strip()}", not "{self._window}".',
                "Click into the right field, then touch this point again.",
            )

    def _call(self, arguments: Sequence[str]) -> str:
        try:
            done = subprocess.run(  # noqa: S603 - numbers and keys, without a shell
                [self._program, *arguments], capture_output=True, text=True, timeout=_LIMIT_S,
                stdin=subprocess.DEVNULL, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise _failed(self._tool, str(error)) from error
        if done.returncode != 0:
            raise _failed(self._tool, done.stderr.strip() or f"exit code {done.returncode}")
        return done.stdout


def _failed(tool: TypingTool, why: str) -> MeasuringError:
    return MeasuringError(
        "keyboard.failed",
        f"{tool.name} could not type ({why}).",
        "Check the last line in the other program, then touch this point again.",
    )
