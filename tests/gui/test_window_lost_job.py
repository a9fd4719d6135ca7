"""A job whose file is lost while the window measures: FAILED, the cause, and no report."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.storage import JobFile
from ocmm_gui.kit import Notice
from tests.gui.conftest import OpenWindow
from tests.host import amount

_ROOT = Path(__file__).resolve().parents[2]

LOSSES: dict[str, tuple[Callable[[Path], object], str]] = {
    "file removed": (Path.unlink, "it was removed"),
    "folder removed": (lambda path: shutil.rmtree(path.parent), "its folder was removed"),
    "folder moved": (
        lambda path: path.parent.rename(path.parent.with_name("elsewhere")),
        "its folder was moved to",
    ),
}


@pytest.mark.parametrize("loss", LOSSES)
def test_a_lost_job_is_failed_and_saved_and_gives_no_report(
    qtbot: QtBot,
    open_window: OpenWindow,
    tmp_path: Path,
    record_property: Callable[[str, object], None],
    loss: str,
) -> None:
    lose, words = LOSSES[loss]
    out = tmp_path / "reports"
    bench = open_window(stay=True, out=out)
    station, window = bench.built.station, bench.window
    acknowledged: list[int] = []
    station.events.point_taken.connect(lambda point: acknowledged.append(point.number))
    qtbot.waitUntil(lambda: len(acknowledged) >= 3, timeout=30000)
    lose(bench.built.job_path)
    lost_s = time.monotonic()
    qtbot.waitUntil(lambda: station.faults.measuring is not None, timeout=30000)
    fault = station.faults.measuring
    assert fault is not None
    # The campaign judges the limit of a second, not this test under load.
    record_property("FAILED after, s", round(fault.at_s - lost_s, 2))
    assert words in fault.error.what
    assert station.looks.live().status is StatusWord.FAILED
    qtbot.waitUntil(lambda: words in window.banner.text(), timeout=30000)
    # The cause is shown before the points are saved, and replaced by the place.
    qtbot.waitUntil(lambda: "are saved in" in window.banner.text(), timeout=30000)
    shown = re.search(r"are saved in (.*\.ocmm)\.", window.banner.text())
    assert shown is not None
    saved = Path(shown[1])
    assert window.banner.dismiss()
    assert not window.banner.dismiss()
    told: list[Notice] = []
    bench.notices.posted.connect(told.append)
    window.actions_by_key["export"].trigger()
    qtbot.waitUntil(lambda: len(told) > 0, timeout=30000)
    assert words in told[0].what
    assert not out.exists()
    with JobFile.open(saved) as job:
        assert {point.number for point in job.points()} >= set(acknowledged)
        assert job.verify() == []


@pytest.mark.slow
def test_a_window_program_ends_with_a_code_for_the_loss() -> None:
    """The short form loses one file; the delay of the message is not tested under load."""
    command = [sys.executable, "-m", "benchmarks.window_names", "--n", str(amount(1, 300))]
    done = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)
    found = done.stdout.partition("acknowledged points: ")[2].partition("\n")[0]
    assert re.fullmatch(r"no findings|\{'told after 1 s': \d+\}", found), done.stdout
