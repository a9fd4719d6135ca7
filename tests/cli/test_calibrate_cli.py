"""Calibrating, relocating and verifying on the command line, with a kill in the middle."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.cameras import KnownPoints
from ocmm_core.calibration.guided import ProcedureKind, Shot, sessions
from tests.commands import Ocmm
from tests.core.calibration.procedure_site import Bench, recorded
from tests.core.calibration.table_writers import write_reference_points, write_shots, write_spots
from tests.host import HANG_S
from tests.programs import rings_of

pytestmark = pytest.mark.slow

CONTROL = KnownPoints(
    ("N1", "N2", "N3", "N4"),
    np.array([[-150.0, -60, -150], [150, -60, -150], [150, 60, -120], [-150, 60, 50]]),
    0.002,
    "nests",
)


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Return the folder of calibrations, next to lists of points."""
    points = Bench.at(tmp_path).points(120)
    (tmp_path / "points.csv").write_bytes(write_reference_points(points))
    (tmp_path / "control.csv").write_bytes(write_reference_points(CONTROL))
    return tmp_path / "cal"


def killed(
    arguments: list[str], folder: Path, session: Path, kind: ProcedureKind, lines: int
) -> int:
    """Start a command, kill it when its session has some lines, and return their number."""
    with subprocess.Popen(
        [sys.executable, "-m", "ocmm_cli", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    ) as program:
        try:
            end = time.monotonic() + HANG_S
            while time.monotonic() < end and program.poll() is None:
                found = sessions(session, kind)
                if found and found[0].read_bytes().count(b"\n") > lines:
                    break
                time.sleep(0.002)
            # The killed program cannot remove them.
            rings = rings_of(program.pid)
        finally:
            program.kill()
        assert program.stdout is not None
        said = program.stdout.read().decode()
    for ring in rings:
        ring.unlink(missing_ok=True)
    assert program.returncode == -signal.SIGKILL, said
    return sessions(session, kind)[0].read_bytes().count(b"\n")


def test_known_points_survive_a_kill_and_become_valid(
    ocmm_here: Ocmm, tmp_path: Path, store: Path, calm_rig: Path
) -> None:
    rig = ["--rig", str(calm_rig), "--calibrations", "cal"]
    command = ["calibrate", "cameras", "--points", "points.csv", *rig]
    folder = store / "recommended" / "sessions"
    lines = killed([*command, "--speed", "4"], tmp_path, folder, ProcedureKind.KNOWN_POINTS, 20)
    assert lines < 120
    other = Bench.at(tmp_path).points(119)
    (tmp_path / "other.csv").write_bytes(write_reference_points(other))
    refused = ocmm_here("calibrate", "cameras", "--points", "other.csv", *rig)
    assert refused.returncode == 2
    assert "started with another list" in refused.stderr
    waiting = ocmm_here(*command)
    assert waiting.returncode == 1, waiting.stderr
    assert "Continue" in waiting.stdout
    assert "waiting for --accept or --keep" in waiting.stdout
    assert len(sessions(folder, ProcedureKind.KNOWN_POINTS)) == 1
    done = ocmm_here(*command, "--accept")
    assert done.returncode == 0, done.stderr
    assert "State    SUSPECT" in done.stdout
    status = ocmm_here("calibrate", "status", *rig)
    assert status.returncode == 1
    verified = ocmm_here("calibrate", "verify", *rig, "--accept")
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert "State    VALID" in verified.stdout
    status = ocmm_here("calibrate", "status", *rig)
    assert status.returncode == 0
    assert "State    VALID" in status.stdout
    assert "whole: history of 2 events, 2 records, 2 sessions" in status.stdout
    # The sentence about a lost session leads to a complete one.
    sessions(folder, ProcedureKind.VERIFICATION)[0].unlink()
    status = ocmm_here("calibrate", "status", *rig)
    assert status.returncode == 1
    assert "/sessions is missing." in status.stdout
    verified = ocmm_here("calibrate", "verify", *rig, "--accept")
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert "1 lost earlier, see the history" in verified.stdout
    history = ocmm_here("calibrate", "history", *rig).stdout
    assert history.index("accepted") < history.index("verification passed")


def test_a_relocation_survives_a_kill_and_becomes_valid(
    ocmm_here: Ocmm, tmp_path: Path, store: Path, calm_rig: Path
) -> None:
    rig = ["--rig", str(calm_rig), "--calibrations", "cal"]
    bench = Bench.at(tmp_path)
    points = bench.points(120)
    (tmp_path / "spots.csv").write_bytes(write_spots(bench.spots(points), points.names))
    first = ocmm_here(
        "calibrate", "cameras", "--points", "points.csv", "--spots", "spots.csv", *rig, "--accept"
    )  # fmt: skip
    assert first.returncode == 0, first.stderr
    command = [
        "calibrate", "relocate", *rig, "--move", "7", "--world", "points",
        "--control", "control.csv", "--poses", "120",
    ]  # fmt: skip
    folder = store / "recommended" / "sessions"
    killed(command, tmp_path, folder, ProcedureKind.RELOCATION, 40)
    done = ocmm_here(*command, "--accept")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Continue" in done.stdout
    assert "the frame moved by" in done.stdout
    killed(
        ["calibrate", "verify", *rig, "--move", "7"],
        tmp_path, folder, ProcedureKind.VERIFICATION, 15,
    )  # fmt: skip
    verified = ocmm_here("calibrate", "verify", *rig, "--move", "7", "--accept")
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert "Continue" in verified.stdout
    assert "State    VALID" in verified.stdout


def test_a_relocation_from_recorded_shots_and_one_that_lacks_some(
    ocmm_here: Ocmm, tmp_path: Path, store: Path
) -> None:
    bench = Bench.at(tmp_path)
    shots = recorded(bench, poses=260, bars=10)
    (tmp_path / "shots.csv").write_bytes(write_shots(shots, bench.rig))
    (tmp_path / "few.csv").write_bytes(write_shots(shots[:50], bench.rig))
    unseated = [shot for shot in shots if shot.kind != "repeat"]
    (tmp_path / "unseated.csv").write_bytes(write_shots(unseated, bench.rig))
    command = ["calibrate", "relocate", "--calibrations", "cal", "--poses", "200", "--accept"]
    few = ocmm_here(*command, "--shots", "few.csv")
    assert few.returncode == 2
    assert "Missing probe poses" in few.stderr
    done = ocmm_here(*command, "--shots", "shots.csv")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "State    SUSPECT" in done.stdout
    assert "No seat was visited" not in done.stdout
    lacking = ocmm_here(*command, "--new", "--shots", "unseated.csv")
    assert lacking.returncode == 0, lacking.stdout + lacking.stderr
    assert "No seat was visited at both start and end" in lacking.stdout
    live = ocmm_here(*command, "--new", "--no-seats")
    assert live.returncode == 2
    assert "for recordings without seats" in live.stderr
    strange = [Shot("nest", "", shots[0].uv, 0.01)]
    (tmp_path / "nests.csv").write_bytes(write_shots(strange, bench.rig))
    wrong = ocmm_here(*command, "--shots", "nests.csv")
    assert wrong.returncode == 2
    assert "kind 'nest'" in wrong.stderr
