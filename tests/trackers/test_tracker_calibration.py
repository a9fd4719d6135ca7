"""Calibrated trackers: measured noise, verification, corrected scale, and what is refused."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.trackers import SCALE_ERROR, TrackerSite, drawn
from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration.cameras import TrackerProcedure, TrackerSetup, correct_scale
from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.records import (
    CalibrationStatus,
    CalibrationStore,
    ProbeStore,
    judge,
    load_bar,
    open_calibration,
    rig_from_record,
)
from ocmm_core.calibration.sweeping import PivotProcedure, PivotSetup
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure
from ocmm_core.camera import load_rig, load_tracker, tracker_rig
from ocmm_core.composition import RECOMMENDED_RIG, StationRequest, make_feed
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.export.certificate import certificate_of_folder
from ocmm_core.export.template import load_paper, standard_template
from ocmm_core.inspection.plan import load_plan
from ocmm_core.options import DEMO_PLAN
from ocmm_core.settings import toml_text
from ocmm_trackers import FrameBuilder
from tests.host import amount

_BAR = resource("artefacts", "verification_bar.toml")
_OTHER_BAR = resource("artefacts", "bar.toml")
_SESSIONS = amount(2, 20)


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> TrackerSite:
    """Return a calibrated and verified tracker whose stated noise was wrong."""
    site = TrackerSite(tmp_path_factory.mktemp("honest"), *drawn(3), 3)
    site.calibrate()
    assert site.verify(load_bar(_BAR)) == ()
    return site


def status_of(site: TrackerSite, document: Path | None = None) -> CalibrationStatus:
    return judge(open_calibration(document or site.file, site.folder), site.now).word


@pytest.mark.statistics
@pytest.mark.parametrize("seed", range(11, 11 + _SESSIONS))
def test_measured_noise_is_that_of_the_device(seed: int, tmp_path: Path) -> None:
    """N = 2 (20). Across and along to 5 %: 2 % of 6,000 frames, and 2 % of a filter's slow part."""
    true, stated = drawn(seed)
    site = TrackerSite(tmp_path, true, stated, seed)
    site.calibrate()
    (record,) = site.store.records()
    assert isinstance(record.tracker, msgspec.Struct)
    found, noise = record.tracker.noise, true.noise
    assert found.sigma_across == pytest.approx(noise.sigma_across, rel=0.05)
    assert found.sigma_along == pytest.approx(noise.sigma_along, rel=0.05)
    assert found.correlation == pytest.approx(noise.correlation, abs=0.03)
    assert found.rounding == noise.rounding
    # An upper limit of 84 %, from some 300 coordinates: never far below, at most half above.
    assert 0.85 * noise.place_sigma < found.place_sigma < 1.5 * noise.place_sigma
    assert status_of(site) is CalibrationStatus.SUSPECT


def test_a_verified_tracker_is_valid(honest: TrackerSite) -> None:
    assert status_of(honest) is CalibrationStatus.VALID
    record = honest.store.active()
    assert record is not None
    in_use = open_calibration(honest.file, honest.folder)
    assert in_use.rig.identity == honest.store.active_hash
    assert in_use.rig.markers == rig_from_record(record).markers
    expired = honest.store.status(datetime.fromisoformat(record.valid_until_utc))
    assert expired.remedy == "Calibrate the tracker."
    squares = honest.squares(40)
    # N = 40; the 99.9 % limit of chi-square with three degrees of freedom per point.
    assert np.isfinite(squares).sum() >= 38
    assert np.nanmean(squares) < 3.0 * 1.8


def test_a_wrong_scale_is_named_and_corrected(tmp_path: Path) -> None:
    site = TrackerSite(tmp_path, *drawn(5), 5, SCALE_ERROR)
    site.calibrate()
    with pytest.raises(CalibrationError) as early:
        correct_scale(site.store, "Ada", "as verified", site.now)
    assert early.value.code == "tracker.scale_passed"
    assert site.verify(load_bar(_BAR)) == ("verification.scale",)
    assert status_of(site) is CalibrationStatus.SUSPECT
    (verification,) = site.store.verifications()
    assert verification.scale is not None
    assert abs(verification.scale.relative - SCALE_ERROR) < 3.5 * verification.scale.sigma
    record = correct_scale(site.store, "Ada", "as verified", site.now)
    assert isinstance(record.tracker, msgspec.Struct)
    assert record.tracker.noise.scale * (1.0 + verification.scale.relative) == pytest.approx(1.0)
    assert record.tracker.noise.scale_sigma == verification.scale.sigma
    assert status_of(site) is CalibrationStatus.SUSPECT
    # The bar that gave the scale proves nothing.
    with pytest.raises(CalibrationError) as same:
        site.verify(load_bar(_BAR))
    assert same.value.code == "verification.same_artefact"
    assert site.verify(load_bar(_OTHER_BAR)) == ()
    assert status_of(site) is CalibrationStatus.VALID


def test_understated_places_fail_the_verification(tmp_path: Path) -> None:
    true, stated = drawn(6)
    site = TrackerSite(tmp_path, true, stated, 6)
    site.calibrate()
    # The errors of places grow after the calibration, as when the head was knocked.
    noise = msgspec.structs.replace(true.noise, place_sigma=6.0 * true.noise.place_sigma)
    (tmp_path / "true").mkdir()
    worse = TrackerSite(tmp_path / "true", msgspec.structs.replace(true, noise=noise), stated, 6)
    site.errors = worse.errors
    assert "verification.noise" in site.verify(load_bar(_BAR))


def test_the_document_must_be_of_the_same_device(honest: TrackerSite, tmp_path: Path) -> None:
    document = load_tracker(honest.file)
    other_noise = msgspec.structs.replace(document.noise, sigma_across=0.02, correlation=0.1)
    for changed, status in (
        (msgspec.structs.replace(document, noise=other_noise), CalibrationStatus.VALID),
        (msgspec.structs.replace(document, serial=7), CalibrationStatus.UNUSABLE),
        (msgspec.structs.replace(document, device_unit="m"), CalibrationStatus.UNUSABLE),
        (msgspec.structs.replace(document, head=(0.0, -900.0, 0.0)), CalibrationStatus.UNUSABLE),
    ):
        path = tmp_path / "tracker.toml"
        path.write_text(toml_text(msgspec.to_builtins(changed)))
        assert status_of(honest, path) is status


def test_a_camera_record_is_not_that_of_a_tracker(honest: TrackerSite, tmp_path: Path) -> None:
    text = RECOMMENDED_RIG.read_text().replace('name = "recommended"', 'name = "tracker"')
    path = tmp_path / "rig.toml"
    path.write_text(text)
    assert status_of(honest, path) is CalibrationStatus.UNUSABLE


def test_the_procedure_is_for_trackers_only(honest: TrackerSite, tmp_path: Path) -> None:
    with pytest.raises(CalibrationError) as cameras:
        TrackerProcedure.start(
            SessionSite(
                tmp_path,
                load_rig(RECOMMENDED_RIG),
                honest.body,
                CalibrationStore(tmp_path / "s").folder,
            ),
            TrackerSetup(who="Ada"),
            honest.now,
        )
    assert cameras.value.code == "session.cameras"


def at_rest(site: TrackerSite, seconds: float, shake_mm: float = 0.0) -> TrackerProcedure:
    """Return a procedure after a rest in the middle of the volume; all markers shake together."""
    rig, rng, document = site.rig, np.random.default_rng(8), load_tracker(site.file)
    procedure = TrackerProcedure.start(
        SessionSite(site.folder / "rest", rig, site.body, site.store.folder),
        TrackerSetup(who="Ada"),
        site.now,
    )
    procedure.advance(site.now)
    leds = rig.volume_world.mean(axis=0) + site.body.leds_probe - site.body.leds_probe.mean(axis=0)
    for first in range(0, round(seconds * rig.frame_rate_hz), 100):
        shaken = leds + shake_mm * rng.standard_normal((100, 1, 3))
        procedure.watch(site.block(rig, site.reported(shaken, document), first))
    return procedure


def test_overstated_noise_is_measured_also(tmp_path: Path) -> None:
    true, _ = drawn(7)
    noise = msgspec.structs.replace(true.noise, place_sigma=0.05)
    site = TrackerSite(tmp_path, true, msgspec.structs.replace(true, noise=noise), 7)
    assert at_rest(site, 62.0).base.live.ready


@pytest.mark.parametrize("kind", ["shaken", "filtered"])
def test_a_bad_minute_at_rest_leads_no_further(kind: str, tmp_path: Path) -> None:
    true, stated = drawn(3)
    if kind == "filtered":
        noise = msgspec.structs.replace(true.noise, correlation=0.94)
        true = msgspec.structs.replace(true, noise=noise)
    site = TrackerSite(tmp_path, true, stated, 3)
    procedure = at_rest(site, 62.0, 0.05 if kind == "shaken" else 0.0)
    procedure.record(site.now)
    with pytest.raises(CalibrationError) as refused:
        procedure.advance(site.now)
    said = {"shaken": "vibrates", "filtered": "smooths its markers"}[kind]
    assert said in refused.value.what
    # The rest is repeated.
    procedure.drop(site.now)
    assert procedure.base.step.done == 0


def test_a_session_resumes_with_its_observations(tmp_path: Path) -> None:
    site = TrackerSite(tmp_path, *drawn(3), 3)
    procedure = at_rest(site, 62.0)
    procedure.record(site.now)
    again = TrackerProcedure.resume(
        SessionSite(procedure.base.session.parent, site.rig, site.body, site.store.folder),
        procedure.base.session,
    )
    assert again.base.step.name == "rest"
    assert again.base.step.gate.open
    again.advance(site.now)
    assert again.base.step.name == "places"


def test_the_reader_applies_the_scale() -> None:
    document = load_tracker(resource("rigs", "tracker.toml"))
    noise = msgspec.structs.replace(document.noise, scale=1.0003)
    scaled = msgspec.structs.replace(document, noise=noise)
    assert tracker_rig(scaled, "").markers is not None
    from ocmm_trackers import MarkerPlace, Pose

    elements = tuple(
        MarkerPlace(name, (100.0 + i, 200.0, 300.0 + 10.0 * i))
        for i, name in enumerate(document.markers)
    )
    (plain,) = FrameBuilder(document).add(Pose(elements, whole=True), 10**18)
    (found,) = FrameBuilder(scaled).add(Pose(elements, whole=True), 10**18)
    np.testing.assert_allclose(found.places, 1.0003 * plain.places, rtol=1e-12)


def test_certificates_name_the_tracker_and_its_noise(honest: TrackerSite) -> None:
    paper, folder = load_paper(standard_template()), honest.store.folder
    calibration = certificate_of_folder(folder, paper, calibration=True)
    verification = certificate_of_folder(folder, paper)
    for one in (calibration, verification):
        assert one.item == "Optical tracker tracker"
        assert ("tracker no.", "40600") in one.identifications
        assert not any(name.startswith("camera ") for name, _ in one.identifications)
    stated = {value.name: value.value for value in calibration.values}
    record = honest.store.active()
    assert record is not None
    assert isinstance(record.tracker, msgspec.Struct)
    assert stated["noise: sigma_across"] == record.tracker.noise.sigma_across
    (scale,) = verification.values
    assert scale.name == "Scale error of all lines"
    assert scale.expanded is not None
    assert abs(scale.value) < 2.0 * scale.expanded


def test_probes_and_tips_are_calibrated_with_trackers(honest: TrackerSite) -> None:
    store = ProbeStore(honest.folder / "probe")
    procedure = PivotProcedure.start(
        SessionSite(honest.folder / "sweeps", honest.rig, honest.body, store.folder),
        PivotSetup(who="Ada", tip="T1"),
        honest.now,
    )
    assert procedure.base.step.name == "prepare"
    assert TipQualificationProcedure.for_trackers
    assert TipCheckProcedure.for_trackers


def test_a_recording_is_replayed_by_its_own_calibration_only(
    honest: TrackerSite, tmp_path: Path
) -> None:
    """The views follow from the noise: by others all distances would be wrong."""
    rig, path = honest.rig, tmp_path / "frames.ocmmframes"
    period = round(1e9 / rig.frame_rate_hz)
    description = SourceDescription(
        name="OpenIGTLink test", camera_serials=tuple(one.serial for one in rig.cameras),
        frame_period_ns=period, cycle_period_ns=period, live=True,
        simulated=False,
    )  # fmt: skip
    leds = rig.volume_world.mean(axis=0) + honest.body.leds_probe
    with FrameRecorder(path, description, rig) as recorder:
        recorder.append(honest.resting(rig, leds))
    request = StationRequest(plan=DEMO_PLAN, out=tmp_path, rig=honest.file, source=f"replay:{path}")
    make_feed(request, load_plan(DEMO_PLAN), rig).end()
    stated = load_rig(honest.file)
    assert [one.serial for one in stated.cameras] == [one.serial for one in rig.cameras]
    with pytest.raises(InputError) as other:
        make_feed(request, load_plan(DEMO_PLAN), stated)
    assert other.value.code == "recording.tracker"
