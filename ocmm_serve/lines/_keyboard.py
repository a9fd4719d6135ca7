"""Keyboard wedge: types each line into the program that has the keyboard focus."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ocmm_core.errors import InputError, MeasuringError

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
