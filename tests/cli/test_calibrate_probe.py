"""Calibrating a probe on the command line: virtual, killed and gone on with, replayed, recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.guided import ProcedureKind, sessions
from ocmm_core.calibration.pivot import PivotSweep
from ocmm_core.calibration.records import ProbeStore
from ocmm_core.geometry import Float
from tests.cli.test_calibrate_cli import killed
from tests.commands import Ocmm
from tests.core.calibration.pivot_site import CONE, OTHER_CONE, SIGMA_PX, PivotBench
from tests.core.calibration.table_writers import write_sweeps

pytestmark = pytest.mark.slow


def recorded(bench: PivotBench, path: Path, shift: Float, n: int = 420) -> Path:
    """Write two sweeps of a probe whose tip is shifted."""
    body = replace(bench.body, tip_probe=bench.body.tip_probe + shift)
    sweeps = [
        PivotSweep.even(bench.swept(seed, cone, n=n, body=body), SIGMA_PX)
        for seed, cone in ((1, CONE), (2, OTHER_CONE))
    ]
    path.write_bytes(write_sweeps(sweeps, bench.rig))
    return path


def test_a_virtual_probe_survives_a_kill_and_its_recording_says_the_same(
    ocmm_here: Ocmm, tmp_path: Path, calm_rig: Path
) -> None:
    folder = tmp_path / "probes"
    command = [
        "calibrate", "probe", "--rig", str(calm_rig), "--tip", "A", "--probes", str(folder),
        "--poses", "150", "--who", "me",
    ]  # fmt: skip
    place = folder / "standard" / "sessions"
    lines = killed(command, tmp_path, place, ProcedureKind.PIVOT, 6)
    assert not ProbeStore(folder / "standard").events
    done = ocmm_here(*command, "--record", "sweeps.ocmm-rec", "--accept")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Continue" in done.stdout
    assert sessions(place, ProcedureKind.PIVOT)[0].read_bytes().count(b"\n") > lines
    for words in ("adjustment", "thesis", "Second against first", "first calibration", "SUSPECT"):
        assert words in done.stdout
    active = ProbeStore(folder / "standard").active("A")
    assert active is not None
    assert active.calibration.made_by == "me"
    assert np.abs(active.calibration.tip_mm).max() < 0.05
    waiting = ocmm_here(*command[:4], "--tip", "B", "--probes", "again", "--poses", "150",
                   "--source", "replay:sweeps.ocmm-rec")  # fmt: skip
    # The recording begins at the last step of the killed session; its rest still makes sweeps.
    assert waiting.returncode == 1, waiting.stdout + waiting.stderr
    assert "waiting for --accept" in waiting.stdout


def test_recorded_sweeps_are_calibrated_and_a_change_wants_a_reason(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    bench = PivotBench(tmp_path)
    base = ("calibrate", "probe", "--tip", "A", "--probes", "probes", "--accept")
    first = ocmm_here(*base, "--sweeps", recorded(bench, tmp_path / "one.csv", np.zeros(3)))
    assert first.returncode == 0, first.stdout + first.stderr
    moved = recorded(bench, tmp_path / "two.csv", np.array([0.0, 0.09, 0.0]))
    refused = ocmm_here(*base, "--sweeps", moved)
    assert refused.returncode == 2
    assert "Give the reason" in refused.stderr
    told = ocmm_here(*base, "--sweeps", moved, "--because", "new stylus")
    assert told.returncode == 0, told.stdout + told.stderr
    assert "Continue" in told.stdout
    store = ProbeStore(tmp_path / "probes" / "standard")
    assert [one.change_reason for one in store.calibrations()] == ["", "new stylus"]
    short = recorded(bench, tmp_path / "three.csv", np.zeros(3), n=60)
    lacking = ocmm_here(*base, "--new", "--sweeps", short)
    assert lacking.returncode == 2
    assert "poses to go" in lacking.stderr
    again = ocmm_here(*base, "--anew", "--sweeps", moved)
    assert again.returncode == 0, again.stdout + again.stderr
    told_of, third = ProbeStore(store.folder).calibrations()[-2:]
    assert third.data_sha256 == told_of.data_sha256, "the short sweep is not in it"
