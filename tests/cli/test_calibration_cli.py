"""Measuring with and without a calibration on the command line."""

from __future__ import annotations

import csv
import re
import shutil
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from ocmm_cli.calibrate._run import virtual_feed
from ocmm_cli.calibrate._steps import own_folder
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration.records import CalibrationStore, store_folder
from ocmm_core.camera import load_rig
from ocmm_core.composition import (
    RECOMMENDED_RIG,
    STANDARD_PROBE,
    Origin,
    StationRequest,
    calibration_of,
    sources,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_sim.calibration_scenes import FreeMotionScene
from ocmm_sim.scene import SimulatedSource
from ocmm_sim.sources import VirtualSite, script_of
from tests.commands import Ocmm
from tests.core.calibration.fresh_tips import Tips
from tests.core.calibration.made_records import make_record, make_verification

QUICK = resource("plans", "quick.toml")


def calibrate(folder: Path, *, until_days: float = 365.0) -> str:
    """Put a verified calibration in force, valid for the given days from now; return its hash."""
    now = datetime.now(UTC)
    record = make_record(valid_until_utc=(now + timedelta(days=until_days)).isoformat())
    store = CalibrationStore(store_folder(folder, "recommended"))
    store.accept(record, "technician", "new", now)
    store.verify(make_verification(record), now)
    assert store.active_hash is not None
    return store.active_hash


@pytest.mark.parametrize(
    ("source", "real"),
    [
        ("simulated", False), ("ethercat:virtual", False), ("ethercat:pixels", False),
        ("replay:run.rec", False), ("ethercat:enp3s0", True), ("ethercat:enp3s0+enp4s0", True),
        ("ethercat:service", True),
    ],
)  # fmt: skip
def test_which_sources_need_a_calibration(source: str, real: bool, tmp_path: Path) -> None:
    in_use = calibration_of(StationRequest(plan=QUICK, out=tmp_path, source=source))
    assert (in_use.fault is not None) is real


def test_a_valid_calibration_is_measured_with_and_named(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    digest = calibrate(tmp_path / "cal")
    done = ocmm_here(
        "measure", "--rig", slow_rig, "--plan", QUICK, "--out", "out", "--calibrations", "cal"
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert f"VALID {digest[:12]}" in done.stdout
    with (tmp_path / "out/QUICK-001_SIMULATED_report.csv").open(newline="") as stream:
        assert {row["Calibration"] for row in csv.DictReader(stream)} == {f"VALID {digest[:12]}"}


def test_an_expired_calibration_ends_with_its_reason_and_exit_code_2(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    calibrate(tmp_path / "cal", until_days=-1.0)
    done = ocmm_here(
        "measure", "--plan", QUICK, "--out", "out", "--calibrations", "cal", "--speed", "1"
    )
    assert done.returncode == 2
    assert done.stderr.startswith("ocmm: EXPIRED: The calibration was valid until ")
    assert "Calibrate the cameras." in done.stderr
    assert "--uncalibrated" in done.stderr
    assert not list((tmp_path / "out").glob("*.csv"))


def test_who_insists_gets_a_report_that_proves_nothing(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    done = ocmm_here(
        "measure",
        "--rig",
        slow_rig,
        "--plan",
        QUICK,
        "--out",
        "out",
        "--calibrations",
        "cal",
        "--uncalibrated",
    )
    assert done.returncode == 1
    assert "never calibrated" in done.stdout
    assert re.search(r"Ball diameter .*NOT PROVEN", done.stdout)
    assert "CONFORM" not in done.stdout.replace("NOT CONFORM", "")
    with (tmp_path / "out/QUICK-001_SIMULATED_UNCALIBRATED_report.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["Test"] for row in rows} == {"Not proven"}
    assert all(row["Calibration"].startswith("UNCALIBRATED ") for row in rows)


def test_recorded_real_cameras_need_a_calibration_too(ocmm_here: Ocmm, tmp_path: Path) -> None:
    # Recorded in this process as if from a bus: the name of the source is that of a bus.
    virtual = script_of(StationRequest(plan=QUICK, out=tmp_path), load_plan(QUICK)).build()
    description = replace(
        SimulatedSource(virtual, 0.0).description, name="EtherCAT on enp3s0", live=True
    )
    rig = load_rig(resource("rigs", "recommended.toml"))
    with FrameRecorder(tmp_path / "run.ocmmrec", description, rig) as recorder:
        recorder.append(virtual.frames(0, 8000))
    arguments = ("measure", "--plan", QUICK, "--source", "replay:run.ocmmrec", "--speed", "0.5")
    done = ocmm_here(*arguments, "--out", "out")
    assert done.returncode == 2
    assert "from real cameras (EtherCAT on enp3s0)" in done.stderr
    digest = calibrate(tmp_path / "cal")
    done = ocmm_here(*arguments, "--out", "out", "--calibrations", "cal")
    assert done.returncode == 2
    assert "from a real probe (EtherCAT on enp3s0)" in done.stderr
    Tips(tmp_path / "tips")
    done = ocmm_here(*arguments, "--out", "out", "--calibrations", "cal", "--probes", "tips")
    assert f"VALID {digest[:12]}" in done.stdout
    assert "VALID standard/6 mm" in done.stdout
    assert "The source ended before the job was complete" in done.stderr


def test_real_cameras_are_not_measured_with_by_a_rig_document(ocmm_here: Ocmm) -> None:
    # The interface does not exist; the calibration in use is named before the interface is opened.
    done = ocmm_here("measure", "--plan", QUICK, "--out", "out", "--source", "ethercat:nope0")
    assert done.returncode == 2
    assert "nope0" in done.stderr
    label = re.search(r"Calibration +NONE [0-9a-f]{12}", done.stdout)
    assert label, done.stdout


def test_status_says_of_which_rig_it_speaks_and_reads_all_files(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    digest = calibrate(tmp_path / "cal")
    status = ("calibrate", "status", "--calibrations", "cal")
    good = ocmm_here(*status)
    assert good.returncode == 0
    assert good.stdout.startswith(
        "Rig      recommended: left (serial 20600001), right (serial 20600002)\n"
    )
    assert "State    VALID" in good.stdout
    assert "whole: history of 2 events, 2 records, 0 sessions" in good.stdout
    # The same folder under the name of another rig, which is then requested.
    shutil.copytree(tmp_path / "cal" / "recommended", tmp_path / "cal" / "thesis")
    other = ocmm_here(*status, "--rig", resource("rigs", "thesis.toml"))
    assert other.returncode == 1
    assert other.stdout.startswith("Rig      thesis: left (serial 20330001)")
    assert "State    UNUSABLE" in other.stdout
    assert "belongs to rig 'recommended', but thesis.toml describes rig 'thesis'" in other.stdout
    (tmp_path / "cal" / "recommended" / f"{digest}.json").unlink()
    lost = ocmm_here(*status)
    assert (lost.returncode, lost.stderr) == (1, "")
    assert f"Record {digest[:12]} in cal/recommended is missing. Restore" in lost.stdout
    (tmp_path / "cal" / "recommended" / "events.jsonl").write_bytes(b"")
    cut = ocmm_here(*status)
    assert (cut.returncode, cut.stderr) == (1, "")
    assert "2 of 2 events are missing at the end. Restore the whole folder" in cut.stdout


@pytest.mark.parametrize("celsius", ["200", "nan"])
def test_a_temperature_that_is_none_begins_no_session(
    ocmm_here: Ocmm, tmp_path: Path, celsius: str
) -> None:
    calibrate(tmp_path / "cal")
    for command in ("verify", "relocate"):
        done = ocmm_here("calibrate", command, "--calibrations", "cal", "--temperature", celsius)
        assert done.returncode == 2
        said = " ".join(done.stderr.replace("│", " ").split())
        assert "The typed temperature is" in said
        assert "Enter a number from 0 to 50 °C." in said
    assert not list((tmp_path / "cal" / "recommended").glob("sessions/*"))


def test_a_virtual_rig_without_scenes_is_refused_and_never_taken_for_a_real_one() -> None:
    script = VirtualSite(RECOMMENDED_RIG, STANDARD_PROBE, 3, None).script(
        (FreeMotionScene(ways=1, seed=1),)
    )
    with pytest.raises(InputError, match="no calibration scenes") as refused:
        virtual_feed(script, "ethercat:pixels", 0.0)
    assert refused.value.remedy == "Give simulated or ethercat:virtual."
    for spec in sources():
        folder = own_folder(f"{spec.prefix}x" if spec.takes_value else spec.prefix)
        assert (folder.name == "virtual-probes") is (spec.origin is Origin.VIRTUAL)
