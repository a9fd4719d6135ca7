"""The keyboard wedge types accepted points into a real text field."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.station.stream import PlainLines
from ocmm_serve.lines._feed import KeyboardReceiver, LineFeed, find_tool
from ocmm_serve.lines._template import LineTemplate
from tests.host import HANG_S, needs_tools, on_linux_only
from tests.waiting import wait_until

EDITOR = """
import sys
from PySide6.QtCore import QFile, QTimer
from PySide6.QtWidgets import QApplication, QPlainTextEdit
app = QApplication(sys.argv)
field = QPlainTextEdit()
field.setWindowTitle("Measured values")
field.textChanged.connect(lambda: open(sys.argv[1], "w").write(field.toPlainText()))
field.show()
field.activateWindow()
field.setFocus()
QTimer.singleShot(300, lambda: open(sys.argv[1] + ".ready", "w").close())
app.exec()
"""


@pytest.fixture
def field(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the file that has the content of a text field on a display of its own."""
    needs_tools("Xvfb", "xdotool", "openbox")
    reading, writing = os.pipe()
    xvfb = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "800x600x24", "-nolisten", "tcp"],
        pass_fds=[writing], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(writing)
    with os.fdopen(reading) as said:
        display = f":{said.readline().strip()}"
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    environment = {**os.environ, "QT_QPA_PLATFORM": "xcb"}
    typed = tmp_path / "typed.txt"
    openbox = subprocess.Popen(["openbox"], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    editor = subprocess.Popen([sys.executable, "-c", EDITOR, str(typed)], env=environment)
    try:
        wait_until(Path(f"{typed}.ready").exists)
        focused = ["xdotool", "getactivewindow", "getwindowname"]
        end = time.monotonic() + HANG_S
        while "Measured values" not in _output(focused):
            assert time.monotonic() < end, "the field got no focus"
        yield typed
    finally:
        for process in (editor, openbox, xvfb):
            process.terminate()
            process.wait(HANG_S)


def _output(command: list[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


@on_linux_only
def test_types_each_point_once(field: Path, tmp_path: Path) -> None:
    plan = resource("plans", "quick.toml")
    station = build_station(StationRequest(plan=plan, out=tmp_path, frame_rate_hz=500)).station
    notes: list[str] = []
    template = LineTemplate.parse("{x:.4f}\\t{y:.4f}\\t{z:.4f}")
    plain = PlainLines(lambda point: template.line(point).encode("ascii") + b"\n", notes.append)
    receiver = KeyboardReceiver(find_tool(), "measured VALUES")
    with LineFeed(station, plain, receiver, notes.append):
        station.start()
        assert station.wait_finished(HANG_S)
        points = station.job.stored()[1]
        wanted = "".join("\t".join(f"{v:.4f}" for v in one.tip_world) + "\n" for one in points)
        wait_until(lambda: field.exists() and len(field.read_text()) >= len(wanted))
    station.close()
    assert field.read_text() == wanted
    assert len(points) == 14
    assert notes == []


@on_linux_only
def test_types_into_no_other_window(field: Path) -> None:
    receiver = KeyboardReceiver(find_tool(), "Calculator")
    with pytest.raises(MeasuringError, match='The active window is "Measured values"'):
        receiver.send(b"-1.5\n")
    KeyboardReceiver(find_tool()).send(b"-1.5\t+2\n")
    wait_until(lambda: field.exists() and field.read_text() == "-1.5\t+2\n")


def test_says_which_program_is_missing(tmp_path: Path) -> None:
    empty = str(tmp_path)
    for environment, said in (
        ({"PATH": empty}, "no desktop session"),
        ({"PATH": empty, "DISPLAY": ":0"}, "needs xdotool"),
        ({"PATH": empty, "WAYLAND_DISPLAY": "wayland-0"}, "needs wtype or ydotool"),
    ):
        with pytest.raises(InputError, match=said):
            find_tool(environment)
    program = tmp_path / "ydotool"
    shutil.copy("/bin/true", program)
    tool = find_tool({"PATH": empty, "WAYLAND_DISPLAY": "wayland-0", "DISPLAY": ":0"})
    assert tool.name == "ydotool"
    with pytest.raises(InputError, match="cannot read the title"):
        KeyboardReceiver(tool, "Excel")


def test_reports_what_was_not_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    needs_tools("xdotool")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    # A display that is not there.
    monkeypatch.setenv("DISPLAY", ":9999")
    with pytest.raises(MeasuringError, match="xdotool could not type"):
        KeyboardReceiver(find_tool()).send(b"1\n")
