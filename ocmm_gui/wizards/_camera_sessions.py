"""How sessions about the cameras begin and go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import get_args

from ocmm_core.calibration.cameras import KnownPointsProcedure, load_reference_points
from ocmm_core.calibration.guided import Kind
from ocmm_core.calibration.records import CalibrationStore, load_bar, load_sphere
from ocmm_core.calibration.relocation import GeometryMode, LensMode, RelocationProcedure, World
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig
from ocmm_core.tracking import ProbeBody
from ocmm_gui.wizards._site import (
    SESSIONS,
    DirectCalculation,
    Opened,
    WizardSite,
    chosen,
    given,
    named,
    running_rig,
    store_folder_of,
    temperature,
)
from ocmm_gui.wizards.parts import ProcessCalculation, ShownProcedure


def begin_camera_session(
    site: WizardSite, kind: Kind, values: Mapping[str, str], now: datetime
) -> Opened:
    """Begin a session about the cameras with what was filled in.

    Raises
    ------
    OcmmError
        A document cannot be used, something is missing, or the session cannot be stored.
    """
    folder = store_folder_of(site)
    store = CalibrationStore(folder)
    rig, who, warm = running_rig(site), named(values), temperature(values["temperature"])
    if kind is Kind.KNOWN_POINTS:
        points = load_reference_points(given(values, "points", "the list of reference points"))
        return opened_camera_session(
            site, kind, rig,
            KnownPointsProcedure.begin(
                folder / SESSIONS, rig, store, points, now, who=who, temperature_c=warm
            ),
        )  # fmt: skip
    bar = load_bar(given(values, "bar", "the document of the length bar"))
    if kind is Kind.RELOCATION:
        control = None
        if values["world"] == "points":
            control = load_reference_points(given(values, "control", "the control points"))
        return opened_camera_session(
            site, kind, rig,
            RelocationProcedure.begin(
                folder / SESSIONS, rig, site.body, store, bar, now, who=who,
                temperature_c=warm, control=control,
                world=chosen(values["world"], get_args(World)),
                lens=chosen(values["lens"], get_args(LensMode)),
                geometry=chosen(values["geometry"], get_args(GeometryMode)),
            ),
        )  # fmt: skip
    sphere = values["sphere"].strip()
    return opened_camera_session(
        site, kind, rig,
        VerificationProcedure.begin(
            folder / SESSIONS, rig, site.body, store, bar, now, who=who,
            temperature_c=warm, spheres=(load_sphere(Path(sphere)),) if sphere else (),
            two_places=values["places"] == "two",
        ),
    )  # fmt: skip


def resumed_camera_session(
    kind: Kind, path: Path, rig: Rig, body: ProbeBody, folder: Path
) -> ShownProcedure:
    """Return the procedure of a session file; also what a process that calculates begins with."""
    store = CalibrationStore(folder)
    if kind is Kind.KNOWN_POINTS:
        return KnownPointsProcedure.resume(path, rig, store)
    if kind is Kind.RELOCATION:
        return RelocationProcedure.resume(path, rig, body, store)
    return VerificationProcedure.resume(path, rig, body, store)


def opened_camera_session(
    site: WizardSite, kind: Kind, rig: Rig, procedure: ShownProcedure
) -> Opened:
    """Return a procedure with what calculates its result."""
    folder = store_folder_of(site)
    again: Callable[[], ShownProcedure] = partial(
        resumed_camera_session, kind, procedure.base.session, rig, site.body, folder
    )
    if kind is Kind.VERIFICATION:
        return Opened(procedure, rig, DirectCalculation(procedure))
    predict = procedure.predict if isinstance(procedure, RelocationProcedure) else None
    return Opened(procedure, rig, ProcessCalculation(procedure, again), predict)
