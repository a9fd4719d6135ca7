"""Replace this process by the window, where a display answers."""

from __future__ import annotations

import importlib.util
import os
import sys

from ocmm_cli.terminal import say, say_later, told
from ocmm_core.errors import InputError
from ocmm_core.host import display_answers, library_fault
from ocmm_core.plugins import install_line

_WITHOUT_QT = say_later("The window needs the package PySide6, which is not installed here.")


def open_window(*arguments: str) -> None:
    """Replace this process by the window, which signals then reach directly."""
    if importlib.util.find_spec("PySide6") is None:
        raise InputError(
            "window.missing",
            _WITHOUT_QT,
            f"Install it: {install_line('gui')}. Without it, measure with 'ocmm measure'.",
        )
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def has_display() -> bool:
    """Return whether a display answers, without loading Qt; write why the window is not opened."""
    if sys.platform != "linux" or os.environ.get("QT_QPA_PLATFORM"):
        return True
    named = {
        kind: name
        for kind, name in (("wayland", "WAYLAND_DISPLAY"), ("xcb", "DISPLAY"))
        if os.environ.get(name)
    }
    if not named:
        return False
    if importlib.util.find_spec("PySide6") is None:
        _tell(say(_WITHOUT_QT))
        return False
    answering = [kind for kind in named if display_answers(kind)]
    if answering:
        if len(named) > 1 and len(answering) == 1:
            # Qt would end with an abort at the other one.
            os.environ["QT_QPA_PLATFORM"] = answering[0]
        return True
    fault = library_fault()
    if fault is not None:
        _tell(told(fault))
        return False
    for name in named.values():
        value = os.environ[name]
        _tell(say(f"{name} is {value!r}, but no display answers there."))
    return False


def _tell(text: str) -> None:
    sys.stderr.write(f"ocmm: {text}\n")
