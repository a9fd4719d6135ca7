"""Fields of each wizard, and the setup of its session from them."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TypedDict, get_args

from ocmm_core.calibration import records
from ocmm_core.calibration.cameras import KnownPointsSetup, TrackerSetup, read_reference_points
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.relocation import (
    GeometryMode,
    LensMode,
    RelocationRequest,
    RelocationSetup,
    World,
)
from ocmm_core.calibration.sweeping import PivotRequest, PivotSetup
from ocmm_core.calibration.tip import QualificationSetup, TouchSetup
from ocmm_core.calibration.verification import VerificationSetup
from ocmm_core.documents import resource
from ocmm_core.typed_numbers import BALL
from ocmm_gui.kit import later, localised, read_number
from ocmm_gui.wizards._site import WizardSite, chosen, given, named, table_options, temperature
from ocmm_gui.wizards.pages import TEMPERATURE, THERMOMETER, WHO, Field

_ALWAYS = (WHO, TEMPERATURE, THERMOMETER)
_BAR = "Length bar document"


def known_points_fields(site: WizardSite) -> tuple[Field, ...]:
    return (
        *_ALWAYS,
        Field(
            "points",
            later("Reference points"),
            later("List of positions: unit, uncertainty, points"),
            "" if site.practice is None else str(site.practice.points),
            table=read_reference_points,
        ),
    )


def known_points_setup(values: Mapping[str, str], now: datetime) -> KnownPointsSetup:
    """Return the setup of a camera calibration; raise OcmmError if a field is wrong."""
    who, warm = named(values), temperature(values, now)
    path = given(values, "points", "the list of reference points")
    points = read_reference_points(path, table_options(values, "points")).points
    return KnownPointsSetup(who=who, temperature=warm, points=points)


def relocation_fields(_site: WizardSite) -> tuple[Field, ...]:
    return (
        *_ALWAYS,
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


def relocation_setup(values: Mapping[str, str], now: datetime) -> RelocationSetup:
    """Return the setup of a relocation; errors as `known_points_setup`."""
    who, warm = named(values), temperature(values, now)
    bar = records.load_bar(given(values, "bar", _BAR))
    control = None
    if values["world"] == "points":
        path = given(values, "control", "the control points")
        control = read_reference_points(path, table_options(values, "control")).points
    return RelocationSetup(
        who=who, temperature=warm, bar=bar, control=control,
        request=RelocationRequest(
            world=chosen(values["world"], get_args(World)),
            lens=chosen(values["lens"], get_args(LensMode)),
            geometry=chosen(values["geometry"], get_args(GeometryMode)),
        ),
    )  # fmt: skip


def tracker_fields(_site: WizardSite) -> tuple[Field, ...]:
    return _ALWAYS


def tracker_setup(values: Mapping[str, str], now: datetime) -> TrackerSetup:
    """Return the setup of a tracker's calibration; errors as `known_points_setup`."""
    return TrackerSetup(who=named(values), temperature=temperature(values, now))


def verification_fields(_site: WizardSite) -> tuple[Field, ...]:
    return (
        *_ALWAYS,
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


def verification_setup(values: Mapping[str, str], now: datetime) -> VerificationSetup:
    """Return the setup of a verification; errors as `known_points_setup`."""
    who, warm = named(values), temperature(values, now)
    bar = records.load_bar(given(values, "bar", _BAR))
    sphere = values["sphere"].strip()
    return VerificationSetup(
        who=who, temperature=warm, bar=bar,
        spheres=(records.load_sphere(Path(sphere)),) if sphere else (),
        two_places=values["places"] == "two",
    )  # fmt: skip


_CONE = Field("cone", later("Cone"), later("Its marking; empty if none"))
_SPHERE = Field(
    "sphere", later("Sphere"), later("Its document, with the certificate"),
    str(resource("artefacts", "sphere.toml")),
)  # fmt: skip


def pivot_fields(site: WizardSite) -> tuple[Field, ...]:
    return (
        *_ALWAYS,
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


def pivot_setup(values: Mapping[str, str], now: datetime) -> PivotSetup:
    """Return the setup of a probe calibration; errors as `known_points_setup`."""
    return PivotSetup(
        who=named(values), temperature=temperature(values, now), tip=values["tip"].strip(),
        cone=_cone(values["cone"]), request=PivotRequest(tip_unknown=values["place"] == "unknown"),
    )  # fmt: skip


def qualification_fields(site: WizardSite) -> tuple[Field, ...]:
    nominal = "" if site.probe is None else localised(f"{2.0 * site.probe.design.tip_radius:g}")
    ball = Field("nominal", later("Ball, mm"), later("Nominal diameter"), nominal)
    return (*_ALWAYS, _mounted(site), ball, _SPHERE, _CONE)


def qualification_setup(values: Mapping[str, str], now: datetime) -> QualificationSetup:
    """Return the setup of a tip qualification; errors as `known_points_setup`."""
    return QualificationSetup(**_touches(values, now), nominal_mm=_diameter(values["nominal"]))


def tip_check_fields(site: WizardSite) -> tuple[Field, ...]:
    return (*_ALWAYS, _mounted(site), _SPHERE, _CONE)


def tip_check_setup(values: Mapping[str, str], now: datetime) -> TouchSetup:
    """Return the setup of a tip check; errors as `known_points_setup`."""
    return TouchSetup(**_touches(values, now))


class _Touches(TypedDict):
    who: str
    temperature: Temperature | None
    tip: str
    sphere: records.Sphere
    cone: records.ArtefactUse | None


def _touches(values: Mapping[str, str], now: datetime) -> _Touches:
    return {
        "who": named(values), "temperature": temperature(values, now),
        "tip": values["tip"].strip(),
        "sphere": records.load_sphere(given(values, "sphere", "the document of the sphere")),
        "cone": _cone(values["cone"]),
    }  # fmt: skip


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


def _cone(text: str) -> records.ArtefactUse | None:
    if not text.strip():
        return None
    return records.ArtefactUse(
        name=text.strip(), serial="", certificate="", certificate_sha256="", due_utc=""
    )


def _diameter(text: str) -> float | None:
    return read_number(BALL, text) if text.strip() else None
