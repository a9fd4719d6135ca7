"""Stage of an acceptance test: procedure, artefacts, cameras, probe, folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import platformdirs

from ocmm_core import acceptance
from ocmm_core.build import build_version
from ocmm_core.calibration.records import CalibrationInUse, ProbeInUse, judge, load_bar, load_sphere
from ocmm_core.camera import Rig
from ocmm_core.composition import _calibration_choice as calibration_choice
from ocmm_core.composition._defaults import DEMO_PLAN
from ocmm_core.composition._feeds import Feed, StationRequest
from ocmm_core.composition._sources import (
    Origin,
    make_feed,
    names_in_words,
    origin_of,
    source_of,
    sources,
    virtual_names,
)
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.fieldbus.described import age_doubts
from ocmm_core.geometry import triple, unit
from ocmm_core.inspection.plan import load_plan

SHIPPED = {
    "bar": ("artefacts", "verification_bar.toml"),
    "sphere": ("artefacts", "acceptance_sphere.toml"),
    "plate": ("artefacts", "plate.toml"),
    "gauge block": ("artefacts", "gauge_block.toml"),
    "dumbbell": ("artefacts", "dumbbell.toml"),
}
"""Artefacts of the virtual rig that no calibration of it used."""


@dataclass(frozen=True, slots=True)
class AcceptanceSite:
    """Stage, calibration, probe and source of one acceptance test."""

    stage: acceptance.Stage
    procedure_sha256: str
    cameras: CalibrationInUse
    probe: ProbeInUse
    source: str
    rig: Path
    probe_document: Path
    seed: int
    """`source`, `rig`, `probe_document`, `seed`: as passed to `open_test_site`."""


def open_test_site(
    procedure: str,
    artefacts: Sequence[str],
    source: str,
    rig: Path,
    probe: Path,
    calibrations: Path | None,
    probes: Path | None,
    tip: str | None,
    seed: int,
) -> AcceptanceSite:
    """Return the site of a test; raise InputError for invalid documents or artefacts."""
    cameras = calibration_choice.choose_calibration(source, rig, calibrations, uncalibrated=False)
    of_probe = calibration_choice.choose_probe(source, probe, probes, tip, uncalibrated=False)
    document, sha256 = acceptance.load_procedure(acceptance.find_procedure(procedure))
    instrument = instrument_of(cameras, of_probe, source, datetime.now(UTC))
    bare = acceptance.Stage(document, instrument, (), seed)
    found = [named_artefact(one) for one in artefacts]
    if origin_of(source) is Origin.VIRTUAL:
        given = {one.role for one in found}
        found += [
            named_artefact(str(resource(*SHIPPED[role])))
            for role in acceptance.kind_of(bare).roles
            if role not in given
        ]
    stage = acceptance.Stage(document, instrument, tuple(found), seed)
    return AcceptanceSite(stage, sha256, cameras, of_probe, source, rig, probe, seed)


def named_artefact(name: str) -> acceptance.UsedArtefact:
    """Return an artefact by its id in the register, or by its document."""
    path = Path(name)
    if path.suffix != ".toml":
        return acceptance.ArtefactRegister().used(name)
    last: InputError | None = None
    for read in (
        acceptance.load_used,
        lambda path: acceptance.used_bar(load_bar(path)),
        lambda path: acceptance.used_sphere(load_sphere(path)),
    ):
        try:
            return read(path)
        except InputError as error:
            if error.code != "document.schema":
                raise
            last = error
    raise InputError(
        "acceptance.artefact_document",
        f"{path}: this is no document of an artefact.",
        "Give ocmm.artefact/1, ocmm.length-bar/1 or ocmm.sphere/1.",
    ) from last


def default_test_folder() -> Path:
    return platformdirs.user_data_path("ocmm") / "acceptance"


def tests_folder(folder: Path | None, site: AcceptanceSite) -> Path:
    """Return the test folder of a site; virtual tests are kept apart."""
    if folder is not None:
        return folder
    base = default_test_folder()
    return base.with_name("virtual-acceptance") if site.stage.instrument.simulated else base


def instrument_of(
    cameras: CalibrationInUse, probe: ProbeInUse, source: str, now: datetime
) -> acceptance.InstrumentState:
    """Return the instrument under test as stored in a record."""
    rig, record = cameras.rig, cameras.record
    low, high = rig.volume_world
    centres = np.array([camera.centre_world for camera in rig.cameras])
    return acceptance.InstrumentState(
        rig=rig.name,
        calibration="" if record is None else rig.identity,
        calibration_status=judge(cameras, now).word.value,
        probe=probe.body.name,
        tip=probe.tip,
        tip_record=probe.body.identity,
        ball_radius=probe.body.tip_radius,
        ball_sigma=probe.body.tip_radius_sigma,
        cameras=tuple(f"{camera.name} no. {camera.serial}" for camera in rig.cameras),
        volume_min=triple(low),
        volume_max=triple(high),
        software=build_version(),
        simulated=origin_of(source) is Origin.VIRTUAL,
        **_doubts(cameras),
        stylus=float(np.linalg.norm(probe.body.leds_probe - probe.body.tip_probe, axis=1).min()),
        away=triple(unit(rig.volume_world.mean(axis=0) - centres.mean(axis=0))),
    )


def _doubts(cameras: CalibrationInUse) -> dict[str, tuple[str, ...]]:
    """Return what described cameras cannot prove; our own records are unaffected."""
    device = cameras.device
    if device is None:
        return {}
    return {"camera_doubts": cameras.camera_doubts, "age_doubts": age_doubts(device)}


def require_recorded(
    cameras: CalibrationInUse,
    probe: ProbeInUse,
    instrument: acceptance.InstrumentState,
    recorded: str,
) -> acceptance.InstrumentState:
    """Return a recording's instrument; CalibrationError: real, but described by a document only."""
    for fault in (
        calibration_choice.checked_for_replay(cameras, recorded).fault,
        calibration_choice.checked_probe_for_replay(probe, recorded).fault,
    ):
        if fault is not None:
            raise CalibrationError("acceptance.replay", fault[1].what, fault[1].remedy)
    virtual = recorded.startswith(virtual_names()) if recorded else instrument.simulated
    return msgspec.structs.replace(instrument, simulated=virtual)


def earlier_use(
    cameras: CalibrationInUse, probe: ProbeInUse, *, spots: bool = False
) -> acceptance.EarlierUse:
    """Return the artefacts of the calibration and the tip; with `spots` also their sessions'."""
    of_cameras = () if cameras.record is None else cameras.record.artefacts
    records = probe.records
    qualification = None if records is None else records.qualification
    of_tip = () if qualification is None else qualification.artefacts
    folders = [one.folder / "sessions" for one in (cameras.store, probe.store) if one is not None]
    return acceptance.EarlierUse(
        of_cameras, of_tip, acceptance.reserved_spots(folders) if spots else ()
    )


def require_scenes(source: str) -> None:
    """Raise InputError if a virtual source plays no touches of an acceptance test."""
    spec = source_of(source).spec
    if spec.origin is Origin.VIRTUAL and spec.hand is None:
        possible = [one for one in sources() if one.origin is not Origin.VIRTUAL or one.hand]
        raise InputError(
            "acceptance.source",
            f"The source is {source!r}, which plays no touches of an acceptance test.",
            f"Give {names_in_words(possible)}.",
        )


def recorded_feed(request: StationRequest, rig: Rig) -> Feed:
    """Return cameras or a recording as the source of a test, not started; ``rig``: in force."""
    return make_feed(request, load_plan(DEMO_PLAN), rig)
