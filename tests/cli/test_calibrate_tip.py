"""Qualifying and checking a tip on the command line, on the virtual rig and on recorded shots."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.guided import Shot
from ocmm_core.calibration.records import ProbeStore
from ocmm_core.calibration.tip import CHECK_RINGS
from tests.commands import Ocmm
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.table_writers import write_shots
from tests.core.calibration.touched_tip import SIGMA_PX, TipWorld

pytestmark = pytest.mark.slow

TIP = "6 mm"


@pytest.fixture
def probes(tmp_path: Path) -> Path:
    """Return the folder of records, with a probe that was calibrated and qualified today."""
    now = datetime.now(UTC)
    store = ProbeStore(tmp_path / "probes" / "standard")
    record = make_probe_record(
        made_utc=now.isoformat(), valid_until_utc=(now + timedelta(days=300)).isoformat()
    )
    store.calibrate(record, "technician", "", now)
    good = make_tip_record(record, diameter_mm=6.0, diameter_sigma_mm=0.0045)
    store.qualify(good, now)
    return tmp_path / "probes"


def test_a_tip_is_qualified_and_checked_live(ocmm_here: Ocmm, probes: Path) -> None:
    said = ocmm_here("calibrate", "tip", "--probes", probes, "--who", "Ada", "--accept")
    assert said.returncode == 0, said.stdout + said.stderr
    assert "Verdict  PASSED" in said.stdout
    assert f"Tip      {TIP}: VALID" in said.stdout
    assert "25, at 25 of 25 places" in said.stdout
    wrong = ocmm_here(
        "calibrate", "check-tip", "--probes", probes, "--scene", "wrong-length", "--accept"
    )
    assert wrong.returncode == 1
    assert "mm longer than at its calibration" in wrong.stdout
    assert "SUSPECT" in wrong.stdout
    records = ProbeStore(probes / "standard")
    assert [one.made_by for one in records.qualifications()] == ["technician", "Ada"]
    assert [one.passed for one in records.checks()] == [False]


def test_recorded_shots_are_checked(ocmm_here: Ocmm, tmp_path: Path, probes: Path) -> None:
    world = TipWorld.of()
    rng = np.random.default_rng(1)
    truth = world.draw(rng)
    # A little more than is wanted: all points of a file count.
    sphere, cone = world.on_sphere(CHECK_RINGS, rng, 0.0041), world.in_cone(rng)
    shots = [Shot("sphere", "", uv, SIGMA_PX) for uv in world.seen(sphere, truth, rng)]
    shots += [Shot("cone", "", uv, SIGMA_PX) for uv in world.seen(cone, truth, rng)]
    (tmp_path / "few.csv").write_bytes(write_shots(shots[:10], world.rig))
    (tmp_path / "good.csv").write_bytes(write_shots(shots, world.rig))
    warm = ("--temperature", "20", "--temperature-u", "0.4")
    options = ("--probes", probes, *warm, "--accept", "--shots")
    few = ocmm_here("calibrate", "check-tip", *options, "few.csv")
    assert few.returncode == 2
    assert "3 points on the sphere are missing" in few.stderr
    # The session goes on with the complete file.
    good = ocmm_here("calibrate", "check-tip", *options, "good.csv")
    assert good.returncode == 0, good.stdout + good.stderr
    assert "Continue" in good.stdout
    assert "Verdict  PASSED" in good.stdout


def test_what_cannot_be_done_is_said(ocmm_here: Ocmm, tmp_path: Path, probes: Path) -> None:
    never = ocmm_here("calibrate", "tip", "--probes", tmp_path / "none")
    assert never.returncode == 2
    assert "was never calibrated" in never.stderr
    other = ocmm_here("calibrate", "check-tip", "--probes", probes, "--tip", "3 mm")
    assert other.returncode == 2
    assert "never calibrated with tip '3 mm'" in other.stderr
