"""Learning the sensors by command: stored with the calibration in force, or refused."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.calibration.monitor import load_baseline
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from tests.commands import Ocmm
from tests.core.station.test_station_calibration import calibrate, fresh_record

COMMAND = ("calibrate", "sensors", "--calibrations", "cal")


@pytest.mark.slow
def test_sensors_are_learnt_for_the_calibration_in_force(
    ocmm_here: Ocmm, tmp_path: Path, calm_rig: Path
) -> None:
    store = calibrate(tmp_path / "cal", fresh_record())
    said = ocmm_here(*COMMAND, "--rig", calm_rig, "--seconds", "40")
    assert said.returncode == 0, said.stdout + said.stderr
    assert "samples; pattern" in said.stdout
    probe = load_probe(resource("probes", "standard.toml"))
    assert store.active_hash is not None
    baseline = load_baseline(store.folder, store.active_hash, probe.identity)
    assert baseline is not None
    assert baseline.left_px < 0.004


def test_nothing_is_learnt_with_a_calibration_in_doubt(ocmm_here: Ocmm, tmp_path: Path) -> None:
    store = calibrate(tmp_path / "cal", fresh_record())
    now = datetime.now(UTC)
    store.suspect("monitor", "Camera left has changed.", now, now)
    said = ocmm_here(*COMMAND)
    assert said.returncode == 2
    assert "Camera left has changed." in said.stderr
    assert list(store.folder.glob("baseline-*")) == []
