"""Fields, start and resume of each wizard's session."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import get_args

from ocmm_core.calibration import records
from ocmm_core.calibration.cameras import (
    KnownPointsProcedure,
    TrackerProcedure,
    read_reference_points,
)
from ocmm_core.calibration.relocation import (
    GeometryMode,
    LensMode,
    RelocationProcedure,
    RelocationRequest,
    World,
)
from ocmm_core.calibration.sweeping import PivotProcedure, PivotRequest
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure, TipSite
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.documents import resource
from ocmm_core.typed_numbers import BALL
from ocmm_gui.kit import later, localised, read_number
from ocmm_gui.wizards._site import (
    SessionPlace,
    WizardSite,
    chosen,
    given,
    named,
    table_options,
    temperature,
)
from ocmm_gui.wizards.pages import TEMPERATURE, THERMOMETER, WHO, Field

_BAR = "Length bar document"


def known_points_fields(site: WizardSite) -> tuple[Field, ...]:
    return (
        WHO,
        TEMPERATURE,
        THERMOMETER,
        Field(
            "points",
            later("Reference points"),
            later("List of positions: unit, uncertainty, points"),
            "" if site.practice is None else str(site.practice.points),
            table=read_reference_points,
        ),
    )


def begin_known_points(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> KnownPointsProcedure:
    """Start a camera calibration; raise OcmmError if impossible."""
    who, warm = named(values), temperature(values, now)
    path = given(values, "points", "the list of reference points")
    points = read_reference_points(path, table_options(values, "points")).points
    store = records.CalibrationStore(place.folder)
    return KnownPointsProcedure.start(
        place.sessions, place.rig, store, points, now, who=who, temperature=warm
    )


def resume_known_points(place: SessionPlace, path: Path) -> KnownPointsProcedure:
    return KnownPointsProcedure.resume(path, place.rig, records.CalibrationStore(place.folder))


def relocation_fields(_site: WizardSite) -> tuple[Field, ...]:
    return (
        WHO,
        TEMPERATURE,
        THERMOMETER,
        Field(
            "bar", later("Length bar"), later("Its document, with the certificate"),
            str(resource("artefacts", "bar.toml")),
        ),
        Field(
            "world", later("World frame"), later("Reference of the coordinates afterwards"),
            choices=(
                ("cameras", later("fixed to the cameras")),
                ("points", later("fixed by known control points")),
                ("set", later("redefined by three points")),
            ),
        ),
        Field(
            "control", later("Control points"),
            later("Their list, if known points keep the world frame"),
            table=read_reference_points, only_with=("world", "points"),
        ),
        Field(
            "lens", later("Lenses"), later("Lens parameters"),
            choices=(
                ("prior", later("refined from known values")),
                ("fixed", later("unchanged")),
                ("free", later("found anew")),
            ),
        ),
        Field(
            "geometry", later("Probe"), later("Source of the LED positions"),
            choices=(
                ("uncertain", later("known within their uncertainty")),
                ("known", later("known exactly")),
                ("unknown", later("unknown: scale from the bar alone")),
            ),
        ),
    )  # fmt: skip


def begin_relocation(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> RelocationProcedure:
    """Start a relocation; raise OcmmError if impossible."""
    who, warm = named(values), temperature(values, now)
    bar = records.load_bar(given(values, "bar", _BAR))
    control = None
    if values["world"] == "points":
        path = given(values, "control", "the control points")
        control = read_reference_points(path, table_options(values, "control")).points
    return RelocationProcedure.start(
        place.sessions, place.rig, place.body, records.CalibrationStore(place.folder), bar, now,
        who=who, temperature=warm, control=control,
        request=RelocationRequest(
            world=chosen(values["world"], get_args(World)),
            lens=chosen(values["lens"], get_args(LensMode)),
            geometry=chosen(values["geometry"], get_args(GeometryMode)),
        ),
    )  # fmt: skip


def resume_relocation(place: SessionPlace, path: Path) -> RelocationProcedure:
    store = records.CalibrationStore(place.folder)
    return RelocationProcedure.resume(path, place.rig, place.body, store)


def tracker_fields(_site: WizardSite) -> tuple[Field, ...]:
    return (WHO, TEMPERATURE, THERMOMETER)


def begin_tracker(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> TrackerProcedure:
    """Start the calibration of a tracker; raise OcmmError if impossible."""
    return TrackerProcedure.start(
        place.sessions, place.rig, place.body, records.CalibrationStore(place.folder), now,
        who=named(values), temperature=temperature(values, now),
    )  # fmt: skip


def resume_tracker(place: SessionPlace, path: Path) -> TrackerProcedure:
    store = records.CalibrationStore(place.folder)
    return TrackerProcedure.resume(path, place.rig, place.body, store)


def verification_fields(_site: WizardSite) -> tuple[Field, ...]:
    return (
        WHO,
        TEMPERATURE,
        THERMOMETER,
        Field(
            "bar", later("Length bar"), later("Not the one used to calibrate the cameras"),
            str(resource("artefacts", "verification_bar.toml")),
        ),
        Field(
            "sphere", later("Sphere"), later("Its document; empty for none"),
            str(resource("artefacts", "sphere.toml")),
        ),
        Field(
            "places", later("Sphere in"), later("Number of places in the volume"),
            choices=(("one", later("one place")), ("two", later("near and far third"))),
        ),
    )  # fmt: skip


def begin_verification(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> VerificationProcedure:
    """Start a verification; raise OcmmError if impossible."""
    who, warm = named(values), temperature(values, now)
    bar = records.load_bar(given(values, "bar", _BAR))
    sphere = values["sphere"].strip()
    return VerificationProcedure.start(
        place.sessions, place.rig, place.body, records.CalibrationStore(place.folder), bar, now,
        who=who, temperature=warm, spheres=(records.load_sphere(Path(sphere)),) if sphere else (),
        two_places=values["places"] == "two",
    )  # fmt: skip


def resume_verification(place: SessionPlace, path: Path) -> VerificationProcedure:
    store = records.CalibrationStore(place.folder)
    return VerificationProcedure.resume(path, place.rig, place.body, store)


_CONE = Field("cone", later("Cone"), later("Its marking; empty if none"))
_SPHERE = Field(
    "sphere", later("Sphere"), later("Its document, with the certificate"),
    str(resource("artefacts", "sphere.toml")),
)  # fmt: skip
_SPHERE_FILE = "the document of the sphere"


def pivot_fields(site: WizardSite) -> tuple[Field, ...]:
    return (
        WHO,
        TEMPERATURE,
        THERMOMETER,
        Field("tip", later("Tip"), later("Marking on the mounted stylus"), _proposed_tip(site)),
        Field(
            "place", later("Where the tip is"), later("What is already known of it"),
            choices=(
                ("document", later("close to the probe document or the last calibration")),
                ("unknown", later("unknown: another stylus")),
            ),
        ),
        _CONE,
    )  # fmt: skip


def begin_pivot(place: SessionPlace, values: Mapping[str, str], now: datetime) -> PivotProcedure:
    """Start a probe calibration; raise OcmmError if impossible."""
    return PivotProcedure.start(
        place.sessions, place.rig, place.body, records.ProbeStore(place.folder),
        values["tip"].strip(), now, who=named(values), temperature=temperature(values, now),
        cone=_cone(values["cone"]), request=PivotRequest(tip_unknown=values["place"] == "unknown"),
    )  # fmt: skip


def resume_pivot(place: SessionPlace, path: Path) -> PivotProcedure:
    return PivotProcedure.resume(path, place.rig, place.body, records.ProbeStore(place.folder))


def qualification_fields(site: WizardSite) -> tuple[Field, ...]:
    nominal = "" if site.probe is None else localised(f"{2.0 * site.probe.design.tip_radius:g}")
    ball = Field("nominal", later("Ball, mm"), later("Nominal diameter"), nominal)
    return (WHO, TEMPERATURE, THERMOMETER, _mounted(site), ball, _SPHERE, _CONE)


def begin_qualification(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> TipQualificationProcedure:
    """Start a tip qualification; raise OcmmError if impossible."""
    who, warm = named(values), temperature(values, now)
    sphere = records.load_sphere(given(values, "sphere", _SPHERE_FILE))
    return TipQualificationProcedure.start(
        place.sessions, _tip_site(place), values["tip"].strip(), sphere, now, who=who,
        temperature=warm, cone=_cone(values["cone"]), nominal_mm=_diameter(values["nominal"]),
    )  # fmt: skip


def resume_qualification(place: SessionPlace, path: Path) -> TipQualificationProcedure:
    return TipQualificationProcedure.resume(path, _tip_site(place))


def tip_check_fields(site: WizardSite) -> tuple[Field, ...]:
    return (WHO, TEMPERATURE, THERMOMETER, _mounted(site), _SPHERE, _CONE)


def begin_tip_check(
    place: SessionPlace, values: Mapping[str, str], now: datetime
) -> TipCheckProcedure:
    """Start a tip check; raise OcmmError if impossible."""
    who, warm = named(values), temperature(values, now)
    sphere = records.load_sphere(given(values, "sphere", _SPHERE_FILE))
    return TipCheckProcedure.start(
        place.sessions, _tip_site(place), values["tip"].strip(), sphere, now, who=who,
        temperature=warm, cone=_cone(values["cone"]),
    )  # fmt: skip


def resume_tip_check(place: SessionPlace, path: Path) -> TipCheckProcedure:
    return TipCheckProcedure.resume(path, _tip_site(place))


def _tip_site(place: SessionPlace) -> TipSite:
    store = records.ProbeStore(place.folder)
    return TipSite(place.rig, place.body, store, _cameras(place), place.hold_s)


def _mounted(site: WizardSite) -> Field:
    """Return the choice of calibrated tips, the mounted one first."""
    tips: tuple[str, ...] = ()
    if site.probe is not None and site.probe.store is not None:
        store = records.ProbeStore(site.probe.store)
        tips = tuple(sorted(store.tips, key=lambda tip: tip != store.mounted))
    choices = tuple((tip, tip) for tip in tips)
    return Field("tip", later("Tip"), later("Currently mounted"), _proposed_tip(site), choices)


def _proposed_tip(site: WizardSite) -> str:
    return "" if site.probe is None else site.probe.tip


def _cameras(place: SessionPlace) -> records.CalibrationStore | None:
    return None if place.cameras is None else records.CalibrationStore(place.cameras)


def _cone(text: str) -> records.ArtefactUse | None:
    if not text.strip():
        return None
    return records.ArtefactUse(
        name=text.strip(), serial="", certificate="", certificate_sha256="", due_utc=""
    )


def _diameter(text: str) -> float | None:
    return read_number(BALL, text) if text.strip() else None
