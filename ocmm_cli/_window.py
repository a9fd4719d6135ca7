"""Replace this process by the window, where a display answers."""

from __future__ import annotations

import importlib.util
import os
import re
import socket
import sys
from contextlib import suppress
from pathlib import Path

from ocmm_cli.terminal import say
from ocmm_core.errors import InputError
from ocmm_core.host import HOST

_ANSWER_S = 1.0
_FIRST_PORT = 6000
"""Port of display 0 of a computer."""


def open_window(*arguments: str) -> None:
    """Replace this process by the window, which signals then reach directly."""
    if importlib.util.find_spec("PySide6") is None:
        raise InputError(
            "window.missing",
            "The window needs the package PySide6, which is not installed here.",
            "Install it: pip install 'ocmm[gui]'. Without it, measure with 'ocmm measure'.",
        )
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def has_display() -> bool:
    """Return whether a display answers, without loading Qt; write which one does not."""
    if sys.platform != "linux" or os.environ.get("QT_QPA_PLATFORM"):
        return True
    wayland, x11 = os.environ.get("WAYLAND_DISPLAY", ""), os.environ.get("DISPLAY", "")
    if (wayland and _wayland_answers(wayland)) or (x11 and _x11_answers(x11)):
        return True
    for name, value in (("WAYLAND_DISPLAY", wayland), ("DISPLAY", x11)):
        if value:
            text = say(f"{name} is {value!r}, but no display answers there.")
            sys.stderr.write(f"ocmm: {text}\n")
    return False


def _wayland_answers(name: str) -> bool:
    path = Path(os.environ.get("XDG_RUNTIME_DIR", "/run"), name)
    return HOST.listens_at(str(path), _ANSWER_S)


def _x11_answers(name: str) -> bool:
    """Return whether an X server listens, by its forms ``:0``, ``unix:0`` and ``host:10.0``."""
    found = re.fullmatch(r"(.*):(\d{1,5})(?:\.\d+)?", name)
    if found is None:
        return False
    host, number = found[1].removeprefix("tcp/"), int(found[2])
    if host in {"", "unix"}:
        path = f"/tmp/.X11-unix/X{number}"  # noqa: S108 - the place of the X Window System
        return any(HOST.listens_at(one, _ANSWER_S) for one in (path, f"\0{path}"))
    with (
        suppress(OSError, OverflowError),
        socket.create_connection((host.strip("[]"), _FIRST_PORT + number), _ANSWER_S),
    ):
        return True
    return False
