"""Whether a display answers and which libraries of the system are missing, without loading Qt.

``python -m ocmm_core.host._display xcb`` (or ``wayland``) exits with 0 if the display accepts this
user. It runs in a child process, which a display that hangs or a faulty library can end.
"""

from __future__ import annotations

import ctypes
import importlib.util
import platform
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ocmm_core.errors import InputError

_ANSWER_S = 3
_LOADING_S = 20.0
"""Libraries come from a cold disk; the display itself has three seconds."""
_PACKAGES = {
    "libGL.so.1": "libgl1", "libEGL.so.1": "libegl1", "libX11.so.6": "libx11-6",
    "libX11-xcb.so.1": "libx11-xcb1", "libglib-2.0.so.0": "libglib2.0-0",
    "libgthread-2.0.so.0": "libglib2.0-0", "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1", "libfreetype.so.6": "libfreetype6",
    "libxkbcommon.so.0": "libxkbcommon0", "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxcb.so.1": "libxcb1", "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4", "libxcb-image.so.0": "libxcb-image0",
    "libxcb-keysyms.so.1": "libxcb-keysyms1", "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxcb-shape.so.0": "libxcb-shape0", "libxcb-xkb.so.1": "libxcb-xkb1",
    "libwayland-client.so.0": "libwayland-client0", "libwayland-cursor.so.0": "libwayland-cursor0",
}  # fmt: skip
"""Packages of Debian and Ubuntu with the libraries that Qt loads."""
_PLUGINS = {"xcb": "libqxcb.so", "wayland": "libqwayland.so"}


def display_answers(kind: str) -> bool:
    """Return whether the X server (``xcb``) or Wayland compositor in the environment answers."""
    command = [sys.executable, "-I", "-m", "ocmm_core.host._display", kind]
    with suppress(OSError, subprocess.TimeoutExpired):
        done = subprocess.run(  # noqa: S603 - our own interpreter and module
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, timeout=_LOADING_S, check=False,
        )  # fmt: skip
        return done.returncode == 0
    return False


def library_fault() -> InputError | None:
    """Return which libraries of the system a window needs and does not find, None if all load."""
    if sys.platform != "linux":
        return None
    missing = [name for name in _PACKAGES if "wayland" not in name and not _loads(name)]
    if not missing:
        return None
    return InputError(
        "window.libraries",
        f"The window needs system libraries that are missing: {', '.join(missing)}.",
        f"Install them: {_install_line(missing)}",
    )


def _install_line(libraries: Sequence[str]) -> str:
    """Return the command that installs libraries on this distribution, or finds them there."""
    system: dict[str, str] = {}
    with suppress(OSError):
        system = platform.freedesktop_os_release()
    family = f"{system.get('ID', '')} {system.get('ID_LIKE', '')}".split()
    provided = [f"'{name}()(64bit)'" for name in libraries]
    if "debian" in family or "ubuntu" in family:
        words = ["sudo apt-get install", *dict.fromkeys(_PACKAGES[name] for name in libraries)]
    elif any("suse" in name for name in family):
        words = ["sudo zypper install", *provided]
    elif {"fedora", "rhel", "centos"} & set(family):
        words = ["sudo dnf install", *provided]
    else:
        words = ["pacman -F" if "arch" in family else "ldconfig -p | grep -F", *libraries]
    return " ".join(words)


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _answers(kind: str) -> bool:
    spec = importlib.util.find_spec("PySide6")
    for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
        plugin = Path(folder, "Qt/plugins/platforms", _PLUGINS[kind])
        # A PySide6 of the distribution keeps its plugins elsewhere, with their dependencies.
        if plugin.is_file() and not _loads(str(plugin)):
            return False
    signal.alarm(_ANSWER_S)
    if kind == "xcb":
        library = ctypes.CDLL("libxcb.so.1")
        library.xcb_connect.restype = ctypes.c_void_p
        library.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
        return not library.xcb_connection_has_error(library.xcb_connect(None, None))
    library = ctypes.CDLL("libwayland-client.so.0")
    library.wl_display_connect.restype = ctypes.c_void_p
    library.wl_display_roundtrip.argtypes = [ctypes.c_void_p]
    display = library.wl_display_connect(None)
    return display is not None and bool(library.wl_display_roundtrip(display) >= 0)


if __name__ == "__main__":
    try:
        sys.exit(0 if _answers(sys.argv[1]) else 1)
    except OSError:
        sys.exit(1)
