"""Equipment of the window by the settings; the station in words; unfinished jobs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.composition import (
    Errand,
    StationRequest,
    build_station,
    request_of_settings,
    station_state,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.finished import last_jobs
from ocmm_core.settings import SETTINGS, Settings, SettingsFile, SettingsStore
from ocmm_core.station import drop_job_without_points

QUICK = resource("plans", "quick.toml")


@pytest.fixture
def shipped(tmp_path: Path) -> Settings:
    missing = SettingsFile(tmp_path / "no" / "settings.toml")
    return SettingsStore(missing, missing).load().settings


def test_as_shipped_a_job_is_measured_as_without_settings(shipped: Settings) -> None:
    request = request_of_settings(shipped, Errand(QUICK))
    plain = StationRequest(plan=QUICK, out=shipped.job_folder, speed=1.0, stay=True)
    assert request == plain


def test_settings_reach_the_request(shipped: Settings, tmp_path: Path) -> None:
    changed = replace(
        shipped,
        instrument_source="ethercat:eth7",
        instrument_tip="long",
        job_operator="Anna",
        temperature_part_c=23.0,
        temperature_compensate_part=True,
        stream_port=7788,
    )
    request = request_of_settings(changed, Errand(QUICK, resume=tmp_path / "a" / "JOB.ocmm"))
    assert request.source == "ethercat:eth7"
    assert request.tip == "long"
    assert request.operator == "Anna"
    nobody = request_of_settings(replace(changed, job_operator=""), Errand(QUICK))
    assert nobody.operator == "unnamed"
    assert request.climate.part_c == 23.0
    assert request.climate.compensate_part
    assert request.stream is not None
    assert request.stream.port == 7788
    assert request.out == tmp_path / "a"


def test_compensation_without_a_temperature_opens_no_job(shipped: Settings, tmp_path: Path) -> None:
    """A stale temperature counts as missing: a job that needs one must not open."""
    changed = replace(shipped, temperature_compensate_part=True, job_folder=tmp_path)
    with pytest.raises(InputError, match="Settings, Temperature"):
        build_station(request_of_settings(changed, Errand(QUICK)))


def test_the_station_says_what_is_missing_and_raises_nothing(shipped: Settings) -> None:
    assert station_state(shipped).simulated
    real = station_state(replace(shipped, instrument_source="ethercat:eth7"))
    assert not real.simulated
    assert [line.usable for line in real.lines] == [False, False]
    assert all("Calibrate" in line.sentence for line in real.lines)
    gone = station_state(replace(shipped, instrument_rig=Path("/no/rig.toml")))
    assert "/no/rig.toml" in gone.lines[0].sentence
    assert not station_state(replace(shipped, instrument_source="webcam")).lines[0].usable


def test_last_jobs_are_bounded_and_a_damaged_one_is_named(tmp_path: Path) -> None:
    assert last_jobs(tmp_path / "none") == ()
    made = []
    for serial in ("1", "2", "3"):
        built = build_station(
            StationRequest(plan=QUICK, out=tmp_path, serial=serial, frame_rate_hz=800)
        )
        built.station.close()
        made.append(built.job_path)
    (tmp_path / "BAD.ocmm").write_bytes(b"x")
    found = last_jobs(tmp_path)
    assert {job.path for job in found} == {*made, tmp_path / "BAD.ocmm"}
    by_path = {job.path: job for job in found}
    assert by_path[tmp_path / "BAD.ocmm"].fault is not None
    assert by_path[made[1]].serial == "2"
    assert (by_path[made[1]].points, by_path[made[1]].complete) == (0, False)
    assert by_path[made[1]].features > 0
    assert len(last_jobs(tmp_path, most=2)) == 2
    assert drop_job_without_points(made[0])
    assert not made[0].exists()


def test_scripts_show_set_and_check_the_settings() -> None:
    run = CliRunner()
    shown = run.invoke(app, ["settings", "show"])
    assert shown.exit_code == 0
    for spec in SETTINGS:
        assert spec.key in shown.stdout
    assert run.invoke(app, ["settings", "set", "window.theme", "light"]).exit_code == 0
    assert "* window.theme" in run.invoke(app, ["settings", "show"]).stdout
    assert (
        '"differs": true' in run.invoke(app, ["settings", "show", "window.theme", "--json"]).stdout
    )
    assert run.invoke(app, ["settings", "check"]).exit_code == 0
    with pytest.raises(InputError, match="Theme"):
        run.invoke(app, ["settings", "set", "window.theme", "pink"], catch_exceptions=False)
    path = SettingsStore.of_this_user().user.path
    path.write_text("no settings")
    checked = run.invoke(app, ["settings", "check"])
    assert checked.exit_code == 2
    path.unlink()


def test_a_tracker_is_called_one(shipped: Settings) -> None:
    tracker = replace(
        shipped, instrument_source="igtl:192.168.1.7:18944",
        instrument_rig=resource("rigs", "tracker.toml"),
    )  # fmt: skip
    state = station_state(tracker)
    assert not state.simulated
    assert [line.what for line in state.lines] == ["Tracker", "Tip"]
    assert state.lines[0].sentence.startswith("Tracker tracker. ")
    assert station_state(shipped).lines[0].what == "Cameras"
    unknown = station_state(replace(shipped, instrument_source="webcam:1"))
    assert "webcam:1" in unknown.lines[0].sentence
