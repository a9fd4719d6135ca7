"""An unforeseen error in the window: FAILED, no digits, no old results, and the true cause."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.app import main
from ocmm_gui.kit import DASHES, THEMES, FitText, Mark, mark_colour
from ocmm_gui.kit._marks import status_mark
from tests.gui.conftest import Bench, OpenWindow
from tests.host import HANG_MS, HANG_S

NO_DIGITS = (DASHES, DASHES, DASHES)


def _raising(*_: Any, **__: Any) -> Any:
    msg = "injected"
    raise ValueError(msg)


def _status(bench: Bench) -> str:
    if bench.window.is_far():
        texts = bench.window.far.findChildren(FitText)
        return next(text for text in texts if text.accessibleName().startswith("Status")).text()
    return bench.window.desk.strip.status.text()


@pytest.mark.parametrize("far", [False, True])
def test_a_dead_reconstruction_leaves_no_digits_and_names_cause_and_log(
    qtbot: QtBot, open_window: OpenWindow, monkeypatch: pytest.MonkeyPatch, far: bool
) -> None:
    bench = open_window(speed=1.0, stay=True)
    window = bench.window
    window.show_far(far)
    readout = window.far.readout if far else window.desk.readout
    qtbot.waitUntil(lambda: DASHES not in readout.values(), timeout=HANG_MS)
    monkeypatch.setattr("ocmm_core.tracking._pipeline.TrackingPipeline.process", _raising)
    qtbot.waitUntil(lambda: readout.values() == NO_DIGITS, timeout=HANG_MS)
    assert _status(bench) == "FAILED"
    assert "ValueError: injected" in readout.accessibleDescription()
    qtbot.waitUntil(lambda: ".log" in window.banner.text(), timeout=HANG_MS)
    assert "The reconstruction failed: ValueError: injected" in window.banner.text()
    assert f"All points taken are saved in {bench.built.job_path}" in window.banner.text()
    monkeypatch.undo()
    qtbot.wait(200)
    assert readout.values() == NO_DIGITS


def test_an_evaluation_that_fails_leaves_no_result_that_looks_current(
    qtbot: QtBot, open_window: OpenWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = open_window(stay=True)
    qtbot.waitUntil(
        lambda: any(r.measured is not None for r in bench.bridge.shown.job.characteristics),
        timeout=HANG_MS,
    )
    monkeypatch.setattr("ocmm_core.inspection.evaluation.evaluate_job", _raising)
    bench.bridge.results.refit()
    qtbot.waitUntil(lambda: _status(bench) == "FAILED", timeout=HANG_MS)
    qtbot.waitUntil(
        lambda: all(r.measured is None for r in bench.bridge.shown.job.characteristics),
        timeout=HANG_MS,
    )
    job = bench.bridge.shown.job
    assert {result.verdict for result in job.characteristics} == {Verdict.NOT_MEASURED}
    assert all(feature.fit is None for feature in job.features)
    assert "The evaluation failed: ValueError: injected" in job.unproven
    cause = "The evaluation failed: ValueError: injected"
    qtbot.waitUntil(lambda: cause in bench.window.banner.text(), timeout=HANG_MS)
    # The panel of the feature shows the cause as well, at any size.
    for size in ((1920, 1080), (1280, 720), (1024, 640), (1920, 1080)):
        bench.window.resize(*size)
        qtbot.wait(50)
    assert bench.window.desk.guidance.step.text().startswith("Open the job again: Start page")


def test_a_window_that_cannot_show_what_is_seen_shows_no_digits(
    qtbot: QtBot, open_window: OpenWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = open_window(speed=1.0, stay=True)
    readout = bench.window.desk.readout
    qtbot.waitUntil(lambda: DASHES not in readout.values(), timeout=HANG_MS)
    # The strip is painted before the readout, which would keep its digits.
    monkeypatch.setattr("ocmm_gui.operator._status_strip.StatusStrip.show_live", _raising)
    qtbot.waitUntil(lambda: readout.values() == NO_DIGITS, timeout=HANG_MS)
    assert "The window failed: ValueError: injected" in readout.accessibleDescription()
    fault = bench.built.station.faults.measuring
    assert fault is not None
    assert fault.part == "The window"


def test_a_command_that_nobody_foresaw_to_fail_is_told(
    qtbot: QtBot, open_window: OpenWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    bench = open_window(stay=True, out=tmp_path / "report")
    monkeypatch.setattr("ocmm_core.station._looks.bus_text", _raising)
    bench.bridge.maintenance.save_bus_text(tmp_path / "bus.txt")
    qtbot.waitUntil(lambda: "ValueError: injected" in bench.window.banner.text(), timeout=HANG_MS)
    assert bench.built.station.faults.measuring is None


@pytest.mark.parametrize("theme", THEMES)
def test_failed_is_as_bad_as_it_gets_in_every_theme(theme: str) -> None:
    assert status_mark(StatusWord.FAILED) is Mark.BAD
    assert mark_colour(THEMES[theme], Mark.BAD) == THEMES[theme].bad


def test_a_window_that_cannot_be_built_ends_with_code_3(
    qtbot: QtBot,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr("ocmm_core.inspection.evaluation.evaluate_job", _raising)
    assert main(["--out", str(tmp_path), "--silent"]) == 3
    said = capsys.readouterr().err
    assert "The evaluation failed: ValueError: injected" in said
    assert "Traceback" not in said


def test_the_program_of_the_window_ends_with_code_3_when_the_measuring_has_failed(
    tmp_path: Path,
) -> None:
    program = (
        "import sys\n"
        "from ocmm_core.tracking._pipeline import TrackingPipeline\n"
        "from ocmm_gui.app import main\n"
        "def process(*a): raise MemoryError('injected')\n"
        "TrackingPipeline.process = process\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run(
        [
            sys.executable, "-c", program, "--silent", "--out", str(tmp_path), "--quit-after", "2",
            "--plan", str(resource("plans", "quick.toml")),
        ],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert "The reconstruction failed: MemoryError: injected" in done.stderr
    assert "Traceback" not in done.stderr
