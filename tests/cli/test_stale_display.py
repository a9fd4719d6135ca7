"""Commands in an environment whose display or libraries do not let a window open."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ocmm_cli.measure import has_display
from tests.host import HANG_S, needs_tools, on_linux_only

pytestmark = on_linux_only

_STALE = [
    {"DISPLAY": ":7654"},
    {"DISPLAY": "unix:7654.0"},
    {"DISPLAY": "127.0.0.1:59000"},
    {"DISPLAY": "nonsense"},
    {"WAYLAND_DISPLAY": "wayland-7654"},
    {"WAYLAND_DISPLAY": "/nowhere/wayland-0", "DISPLAY": ":7654"},
]
_LIBRARIES = ["libGL.so.1", "libEGL.so.1", "libxcb-cursor.so.0"]


@pytest.fixture(autouse=True)
def _no_display(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@contextmanager
def wayland_server(path: Path, *, answers: bool) -> Iterator[None]:
    """Listen as a compositor that answers the first request, or hangs."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        server.listen()

        def serve() -> None:
            try:
                client, _ = server.accept()
            except OSError:
                # On a busy computer the probe has given up before it connected.
                return
            with client:
                client.recv(64)
                if answers:
                    # The event `done` of the callback, object 2, that `wl_display.sync` made.
                    words = (2, 12 << 16, 1)
                    client.sendall(b"".join(word.to_bytes(4, sys.byteorder) for word in words))
                client.recv(64)

        serving = threading.Thread(target=serve)
        serving.start()
        try:
            yield
        finally:
            server.shutdown(socket.SHUT_RDWR)
            serving.join()


@contextmanager
def x_server() -> Iterator[str]:
    """Start an X server on a free display, and yield its name."""
    needs_tools("Xvfb")
    reader, writer = os.pipe()
    with subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", "640x480x24"],
        pass_fds=[writer], stderr=subprocess.DEVNULL,
    ) as server:  # fmt: skip
        os.close(writer)
        with os.fdopen(reader) as told:
            number = told.readline().strip()
        yield f":{number}"
        server.terminate()


@pytest.mark.parametrize("stale", _STALE, ids=str)
def test_names_each_display_that_does_not_answer(
    stale: dict[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, value in stale.items():
        monkeypatch.setenv(name, value)
    assert not has_display()
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        f"ocmm: {name} is {stale[name]!r}, but no display answers there."
        for name in ("WAYLAND_DISPLAY", "DISPLAY")
        if name in stale
    ]


def test_uses_the_display_that_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with x_server() as name:
        monkeypatch.setenv("DISPLAY", name)
        monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-7654")
        assert has_display()
        assert os.environ.pop("QT_QPA_PLATFORM") == "xcb"
    monkeypatch.setenv("DISPLAY", ":7654")
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-1")
    with wayland_server(tmp_path / "wayland-1", answers=True):
        assert has_display()
    assert os.environ.pop("QT_QPA_PLATFORM") == "wayland"
    assert not has_display()


def test_does_not_wait_for_a_display_that_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-1")
    with wayland_server(tmp_path / "wayland-1", answers=False):
        assert not has_display()


def test_prints_the_help_instead_of_opening_a_window() -> None:
    done = _run("ocmm_cli", DISPLAY=":7654")
    assert done.returncode == 0
    assert "Usage: " in done.stdout
    assert done.stderr == "ocmm: DISPLAY is ':7654', but no display answers there.\n"


def test_the_window_ends_with_a_sentence_and_not_with_an_abort() -> None:
    done = _run("ocmm_gui", "--start", DISPLAY=":7654")
    assert done.returncode == 2
    assert done.stderr.startswith("No display available for the window.\nStart OCMM on a desktop")
    # The message of Qt names the missing display or library.
    assert "could not connect to display :7654" in done.stderr


@pytest.mark.parametrize("words", [("ocmm_cli",), ("ocmm_gui", "--start")], ids=str)
@pytest.mark.parametrize("library", _LIBRARIES)
def test_names_missing_libraries(words: tuple[str, ...], library: str, tmp_path: Path) -> None:
    # A text file hides the library of the system, as if it were not installed.
    (tmp_path / library).write_bytes(b"")
    done = _run(*words, DISPLAY=":7654", LD_LIBRARY_PATH=str(tmp_path))
    assert done.returncode == (0 if words == ("ocmm_cli",) else 2)
    assert f"The window needs system libraries that are missing: {library}." in done.stderr
    assert "Install them: " in done.stderr


@pytest.mark.parametrize("name", ["LANG", "LC_ALL"])
def test_no_locale_is_no_warning(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for other in ("LANG", "LC_ALL", "LC_CTYPE"):
        monkeypatch.delenv(other, raising=False)
    code = "from ocmm_gui.app import make_application; make_application()"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, name: "C", "QT_QPA_PLATFORM": "offscreen"},
        capture_output=True, text=True, timeout=HANG_S, check=True,
    )  # fmt: skip
    assert done.stderr == ""


def _run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", *words], env={**os.environ, **environment},
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
