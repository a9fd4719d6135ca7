"""Commands in an environment with a display that does not respond."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_cli._window import has_display
from tests.host import HANG_S, on_linux_only

pytestmark = on_linux_only

_STALE = [
    {"DISPLAY": ":7654"},
    {"DISPLAY": "unix:7654.0"},
    {"DISPLAY": "127.0.0.1:59000"},
    {"DISPLAY": "nonsense"},
    {"WAYLAND_DISPLAY": "wayland-7654"},
    {"WAYLAND_DISPLAY": "/nowhere/wayland-0", "DISPLAY": ":7654"},
]


@pytest.fixture(autouse=True)
def _no_display(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


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


def test_finds_displays_that_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":7654")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "wayland-1"))
        server.listen()
        monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-1")
        assert has_display()
        monkeypatch.setenv("WAYLAND_DISPLAY", str(tmp_path / "wayland-1"))
        assert has_display()
    assert not has_display()
    monkeypatch.delenv("WAYLAND_DISPLAY")
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setenv("DISPLAY", f"127.0.0.1:{server.getsockname()[1] - 6000}.0")
        assert has_display()


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


def _run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", *words], env={**os.environ, **environment},
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
