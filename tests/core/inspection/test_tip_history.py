"""An older job shows the fate of its tip if the history of the probe is available."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.calibration.records import open_probe
from ocmm_core.export.report import report_of_job
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tolerances.decisions import Verdict
from tests.core.calibration.fresh_tips import TIP, Tips
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench


@pytest.fixture
def tips(tmp_path: Path) -> Tips:
    return Tips(tmp_path / "probes")


@pytest.fixture
def measured(bench: Bench, tips: Tips) -> Path:
    """Measure the plan with a good tip, and close the job."""
    in_use = open_probe(PROBE, tips.store.folder.parent)
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
    path = bench.folder / "before.ocmm"
    with JobFile.create(path, replace(head, probe_text=in_use.probe_text)) as job:
        session = InspectionSession(bench.plan, bench.rig, in_use.body, job, SessionOptions())
        for touch in bench.touches:
            session.touches.record_touch(touch)
    return path


def test_a_check_that_failed_later_puts_the_jobs_before_it_in_doubt(
    measured: Path, tips: Tips
) -> None:
    probes = tips.store.folder.parent
    good = reopen_job(measured, probes)
    assert (good.doubts, good.view.held) == ((), ())
    assert {result.verdict for result in good.view.characteristics} == {Verdict.CONFORM}
    before = measured.read_bytes()
    tips.check(passed=False)
    again = reopen_job(measured, probes)
    assert again.view.held == tuple(range(1, 15))
    assert {result.verdict for result in again.view.characteristics} == {Verdict.NOT_PROVEN}
    (doubt,) = again.doubts
    assert doubt.startswith(f"The check of tip '{TIP}' failed")
    assert doubt.endswith("14 points are suspect. Re-probe them.")
    assert report_of_job(again).notes == again.doubts
    # A passed check proves nothing about earlier times; the file is unchanged.
    tips.check()
    assert reopen_job(measured, probes).view.held == again.view.held
    assert measured.read_bytes() == before
    shown = CliRunner().invoke(
        app, ["report", str(measured), "--format", "json", "--preview", "--probes", str(probes)]
    )
    assert shown.exit_code == 0
    assert "14 points are suspect" in shown.output


def test_a_doubt_lasts_until_the_check(measured: Path, tips: Tips) -> None:
    probes = tips.store.folder.parent
    tips.store.mount(TIP, "Ada", datetime.now(UTC))
    again = reopen_job(measured, probes)
    assert len(again.view.held) == 14
    assert "Run the quick tip check" in again.doubts[0]
    tips.check()
    assert reopen_job(measured, probes).doubts == ()


def test_a_history_of_another_probe_of_that_name_or_of_none_says_nothing(
    measured: Path, tips: Tips, tmp_path: Path
) -> None:
    tips.check(passed=False)
    assert reopen_job(measured, tmp_path / "nowhere").doubts == ()
    assert not (tmp_path / "nowhere").exists()
    other = Tips(tmp_path / "others")
    other.check(passed=False)
    assert other.store.active_hash(TIP) != tips.store.active_hash(TIP)
    assert reopen_job(measured, tmp_path / "others").doubts == ()


def test_a_history_that_cannot_be_read_is_told_and_then_nothing_is_proven(
    measured: Path, tips: Tips
) -> None:
    chain = tips.store.folder / "events.jsonl"
    chain.write_bytes(chain.read_bytes().replace(b"technician", b"somebody--", 1))
    again = reopen_job(measured, tips.store.folder.parent)
    assert "cannot be read" in again.doubts[0]
    assert {result.verdict for result in again.view.characteristics} == {Verdict.NOT_PROVEN}
