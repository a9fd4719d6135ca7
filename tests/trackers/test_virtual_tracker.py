"""A whole job with the virtual tracker, and what does not apply to trackers."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_core.calibration.records import CalibrationStatus, open_calibration, open_design
from ocmm_core.camera import load_rig
from tests.commands import Ocmm
from tests.host import private_network
from tests.short_plan import wire_plan_in
from tests.trackers.tracker_bench import TRACKER, written


@pytest.mark.slow
@pytest.mark.parametrize("protocol", ["igtl", "natnet", "ndi", "qtm"])
def test_a_part_is_measured_by_a_tracker(protocol: str, ocmm_here: Ocmm, tmp_path: Path) -> None:
    private_network()
    done = ocmm_here(
        "measure", "--source", f"{protocol}:virtual", "--plan", wire_plan_in(tmp_path),
        "--out", tmp_path, "--seed", "3",
    )  # fmt: skip
    assert "PART CONFORMS" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0
    (job,) = tmp_path.glob("*.ocmm")
    # The job holds the document of the tracker: it is evaluated again without it.
    again = ocmm_here("report", job)
    assert "PART CONFORMS" in again.stdout, again.stdout + again.stderr


def test_a_real_tracker_is_not_calibrated(tmp_path: Path) -> None:
    path = written(tmp_path)
    opened = open_calibration(path, tmp_path / "records")
    assert opened.fault is not None
    word, why = opened.fault
    assert word is CalibrationStatus.NONE
    assert "Nothing on this computer proves" in str(why)
    assert open_design(path).rig.identity == opened.rig.identity


def test_cameras_are_not_calibrated_with_a_tracker(ocmm: Ocmm, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    places = "".join(f"{n},{10 * n},{n * n},{-5 * n}\n" for n in range(20))
    head = "# unit: mm\n# uncertainty: 0.0017\n# frame: world\nname,x,y,z\n"
    points.write_text(head + places, "utf-8")
    done = ocmm(
        "calibrate", "cameras", "--source", "simulated", "--rig", TRACKER, "--calibrations",
        tmp_path / "records", "--points", points,
    )  # fmt: skip
    assert done.returncode != 0
    assert "is for cameras and does not apply" in " ".join((done.stdout + done.stderr).split())
    assert load_rig(TRACKER).markers is not None
