"""Cameras that cannot prove the age of their data: refused, or used with a reservation."""

from __future__ import annotations

import io
import json
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import PlainConsole
from ocmm_core.calibration.cameras import KnownPointsProcedure, KnownPointsSetup
from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.records import CalibrationStore, judge, open_design
from ocmm_core.camera import load_rig
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.export.certificate import certificate_of_folder
from ocmm_core.export.report import head_table, report_of_job
from ocmm_core.export.template import plain_paper
from ocmm_core.fieldbus.described import doubts_by_name, doubts_of, load_device, resting_doubt_mm
from ocmm_core.inspection.evaluation import JobHeader, state_lines
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan, save_plan
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.core.calibration.procedure_site import Bench

PLAN = resource("plans", "quick.toml")
DOUBTS = (
    "Cameras 'Plain spots': no check sum: inputs of two cameras that change places are not noticed "
    "by the bus.",
    "Cameras 'Plain spots': no common clock: the time of an exposure is known within 0.5 ms, a "
    "resting ball within 1 µm.",
)

LINE = "Cameras 'Plain spots': no check sum, no common clock. Job and report say what follows."


def rig_of(folder: Path, device: str = "plain-spots") -> Path:
    text = resource("rigs", "recommended.toml").read_text()
    path = folder / "rig.toml"
    path.write_text(
        text.replace("\nheight_px = 2048\n", f'\nheight_px = 2048\ndevice = "{device}"\n')
    )
    assert path.read_text().count("device =") == 2
    return path


def allowing(folder: Path) -> Path:
    path = folder / "allowing.toml"
    path.write_text(f'cameras = "unproven"\n{PLAN.read_text()}')
    return path


def request(folder: Path, plan: Path, rig: Path) -> StationRequest:
    return StationRequest(
        plan=plan, out=folder / "out", rig=rig, source="simulated", seed=4, frame_rate_hz=800
    )


def test_only_what_has_no_age_or_order_needs_the_leave_of_a_plan() -> None:
    def needs(device: str) -> set[str]:
        return {doubt.code for doubt in doubts_of(load_device(device)) if doubt.of_age}

    assert needs("thesis-camera") == {"device.no_counter", "device.no_time"}
    assert needs("plain-spots") == {"device.arrival_time"}


@pytest.mark.parametrize(
    ("device", "why"), [("thesis-camera", "no counter"), ("plain-spots", "no common clock")]
)
def test_a_plan_that_does_not_say_so_does_not_measure_with_them(
    device: str, why: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=why) as caught:
        build_station(request(tmp_path, PLAN, rig_of(tmp_path, device)))
    assert caught.value.code == "device.unproven"
    assert "field 'cameras' of the plan" in caught.value.remedy
    assert not (tmp_path / "out").exists()


def test_no_later_job_of_the_station_gets_round_the_rule(tmp_path: Path) -> None:
    built = build_station(request(tmp_path, allowing(tmp_path), rig_of(tmp_path)))
    station = built.station
    try:
        with pytest.raises(InputError, match="no common clock"):
            station.jobs.change_plan(PLAN, JobHeader("operator", "", "2"))
        assert station.job.plan.cameras == "unproven"
    finally:
        station.close()


def test_the_rule_is_kept_where_a_plan_is_written(tmp_path: Path) -> None:
    plan = load_plan(allowing(tmp_path))
    assert plan.cameras == "unproven"
    save_plan(plan, tmp_path / "again.toml")
    assert load_plan(tmp_path / "again.toml").cameras == "unproven"
    assert load_plan(PLAN).cameras == "proven"


def test_the_calibration_in_use_says_what_the_cameras_cannot_prove(tmp_path: Path) -> None:
    view = judge(open_design(rig_of(tmp_path)), datetime.now(UTC))
    assert view.warnings == (LINE,)
    assert (
        judge(open_design(resource("rigs", "recommended.toml")), datetime.now(UTC)).warnings == ()
    )


def test_measured_knowingly_job_and_report_say_it_and_it_costs_u(tmp_path: Path) -> None:
    told = io.StringIO()
    covariances = []
    for name, plan, rig in (
        ("ours", PLAN, resource("rigs", "recommended.toml")),
        ("described", allowing(tmp_path), rig_of(tmp_path)),
    ):
        folder = tmp_path / name
        built = build_station(request(folder, plan, rig))
        view = run_job(built, folder / "out", PlainConsole(file=told, width=400), formats=["json"])
        assert view.complete
        job = reopen_job(built.job_path)
        assert job.doubts == ()
        covariances.append([point.random_covariance for point in job.points])
        assert job.view.camera_doubts == view.camera_doubts
    assert told.getvalue().count(LINE) == 1
    assert view.camera_doubts == DOUBTS
    # The same touches: they differ in the uncertainty of time, uniform within 1 µm along each axis.
    cost = resting_doubt_mm(load_device("plain-spots"))
    assert cost == pytest.approx(0.001)
    for ours, theirs in zip(*covariances, strict=True):
        np.testing.assert_allclose(theirs - ours, np.eye(3) * cost**2 / 3.0, rtol=0, atol=1e-12)

    assert state_lines(job.view)[1] == f"CAMERAS UNPROVEN: {' '.join(DOUBTS)}"
    data = report_of_job(job)
    assert data.states == ("SIMULATED", "CAMERAS UNPROVEN")
    assert data.stem.endswith("_SIMULATED_CAMERAS_UNPROVEN")
    rows = {row[0]: row[1] for row in head_table(data).rows}
    assert (rows["Cameras 1"], rows["Cameras 2"]) == DOUBTS
    (written,) = (tmp_path / "described").rglob("*_CAMERAS_UNPROVEN.json")
    report = json.loads(written.read_text())
    assert report["state"] == ["SIMULATED", "CAMERAS UNPROVEN"]
    assert tuple(report["job"]["camera_doubts"]) == DOUBTS


def test_calibrations_are_refused_unless_the_rig_document_allows_them(tmp_path: Path) -> None:
    now = datetime.now(UTC)
    rig = load_rig(rig_of(tmp_path))
    bench = Bench.at(tmp_path / "site")
    points = bench.points(20)
    store = CalibrationStore(tmp_path / "store")
    with pytest.raises(InputError, match="no common clock") as caught:
        KnownPointsProcedure.start(
            SessionSite(tmp_path / "sessions", rig, bench.body, store.folder),
            KnownPointsSetup(who="Ada", points=points),
            now,
        )
    assert "'calibrate_unproven' of the rig document" in caught.value.remedy
    assert not (tmp_path / "sessions").exists()
    allowed = tmp_path / "allowed.toml"
    allowed.write_text(f"calibrate_unproven = true\n{(tmp_path / 'rig.toml').read_text()}")
    begun = KnownPointsProcedure.start(
        SessionSite(tmp_path / "sessions", load_rig(allowed), bench.body, store.folder),
        KnownPointsSetup(who="Ada", points=points),
        now,
    )
    assert begun.base.session.exists()


def test_the_papers_of_such_cameras_say_so(tmp_path: Path) -> None:
    record = make_record()
    described = tuple(msgspec.structs.replace(one, device="plain-spots") for one in record.cameras)
    record = msgspec.structs.replace(record, cameras=described)
    store = CalibrationStore(tmp_path / "cameras")
    store.accept(record, "Ada", "first", MADE)
    store.verify(make_verification(record), MADE)
    for calibration in (True, False):
        paper = certificate_of_folder(tmp_path / "cameras", plain_paper(), calibration=calibration)
        assert paper.states == (f"CAMERAS UNPROVEN: {' '.join(DOUBTS)}",)
    # A description that is not here proves nothing.
    assert "nothing is proven" in doubts_by_name("not-there")[0]
