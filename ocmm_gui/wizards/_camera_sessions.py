from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import get_args

from ocmm_core.calibration.cameras import KnownPointsProcedure, read_reference_points
from ocmm_core.calibration.records import CalibrationStore, load_bar, load_sphere
from ocmm_core.calibration.relocation import GeometryMode, LensMode, RelocationProcedure, World
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.documents import resource
from ocmm_gui.kit import later
from ocmm_gui.wizards._site import (
    SessionPlace,
    WizardSite,
    chosen,
    given,
    named,
    table_options,
    temperature,
)
from ocmm_gui.wizards.parts import TEMPERATURE, THERMOMETER, WHO, Field

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
    store = CalibrationStore(place.folder)
    return KnownPointsProcedure.begin(
        place.sessions, place.rig, store, points, now, who=who, temperature=warm
    )


def resume_known_points(place: SessionPlace, path: Path) -> KnownPointsProcedure:
    return KnownPointsProcedure.resume(path, place.rig, CalibrationStore(place.folder))


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
    bar = load_bar(given(values, "bar", _BAR))
    control = None
    if values["world"] == "points":
        path = given(values, "control", "the control points")
        control = read_reference_points(path, table_options(values, "control")).points
    return RelocationProcedure.begin(
        place.sessions, place.rig, place.body, CalibrationStore(place.folder), bar, now,
        who=who, temperature=warm, control=control,
        world=chosen(values["world"], get_args(World)),
        lens=chosen(values["lens"], get_args(LensMode)),
        geometry=chosen(values["geometry"], get_args(GeometryMode)),
    )  # fmt: skip


def resume_relocation(place: SessionPlace, path: Path) -> RelocationProcedure:
    store = CalibrationStore(place.folder)
    return RelocationProcedure.resume(path, place.rig, place.body, store)


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
    bar = load_bar(given(values, "bar", _BAR))
    sphere = values["sphere"].strip()
    return VerificationProcedure.begin(
        place.sessions, place.rig, place.body, CalibrationStore(place.folder), bar, now,
        who=who, temperature=warm, spheres=(load_sphere(Path(sphere)),) if sphere else (),
        two_places=values["places"] == "two",
    )  # fmt: skip


def resume_verification(place: SessionPlace, path: Path) -> VerificationProcedure:
    store = CalibrationStore(place.folder)
    return VerificationProcedure.resume(path, place.rig, place.body, store)
