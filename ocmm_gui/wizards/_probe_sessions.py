"""How sessions about the probe and its tips begin and go on."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from functools import partial
from pathlib import Path

from ocmm_core.calibration.guided import Kind
from ocmm_core.calibration.records import ArtefactUse, CalibrationStore, ProbeStore, load_sphere
from ocmm_core.calibration.sweeping import PivotProcedure
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure
from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tracking import ProbeBody
from ocmm_gui.wizards._site import (
    SESSIONS,
    DirectCalculation,
    Opened,
    WizardSite,
    given,
    named,
    probe_site_of,
    running_rig,
    temperature,
)
from ocmm_gui.wizards.parts import TEMPERATURE, WHO, Field, ProcessCalculation, ShownProcedure

PROBE_KINDS = (Kind.PIVOT, Kind.QUALIFICATION, Kind.TIP_CHECK)

_CONE = Field("cone", "Cone", "What is written on it; leave it empty if nothing is")
_SPHERE = Field(
    "sphere", "Sphere", "Its document with the certificate",
    str(resource("artefacts", "sphere.toml")),
)  # fmt: skip


def probe_fields(site: WizardSite, kind: Kind) -> tuple[Field, ...]:
    """Return what is filled in before a session about the probe begins."""
    tips = _known_tips(site)
    proposed = "" if site.probe is None else site.probe.tip
    if kind is Kind.PIVOT:
        return (
            WHO,
            TEMPERATURE,
            Field("tip", "Tip", "What is written on the stylus that is mounted", proposed),
            Field(
                "place", "Where the tip is", "What is known of it before",
                choices=(
                    ("document", "about as the probe's document says, or as it was"),
                    ("unknown", "not known: another stylus"),
                ),
            ),
            _CONE,
        )  # fmt: skip
    choices = tuple((tip, tip) for tip in tips)
    mounted = Field("tip", "Tip", "The one that is mounted", proposed, choices)
    if kind is Kind.TIP_CHECK:
        return (WHO, TEMPERATURE, mounted, _SPHERE, _CONE)
    nominal = "" if site.probe is None else f"{2.0 * site.probe.design.tip_radius:g}"
    ball = Field("nominal", "Ball, mm", "Diameter that it should have", nominal)
    return (WHO, TEMPERATURE, mounted, ball, _SPHERE, _CONE)


def begin_probe_session(
    site: WizardSite, kind: Kind, values: Mapping[str, str], now: datetime
) -> Opened:
    """Begin a session about the probe with what was filled in.

    Raises
    ------
    OcmmError
        A document cannot be used, something is missing, or the session cannot be stored.
    """
    probe, folder = probe_site_of(site)
    rig, store, tip = running_rig(site), ProbeStore(folder), values["tip"].strip()
    who, warm, cone = named(values), temperature(values["temperature"]), _cone(values["cone"])
    place, cameras = folder / SESSIONS, _cameras(site.store)
    if kind is Kind.PIVOT:
        return opened_probe_session(
            site, kind,
            PivotProcedure.begin(
                place, rig, probe.design, store, tip, now, who=who, temperature_c=warm,
                tip_unknown=values["place"] == "unknown", cone=cone,
            ),
        )  # fmt: skip
    sphere = load_sphere(given(values, "sphere", "the document of the sphere"))
    if kind is Kind.QUALIFICATION:
        return opened_probe_session(
            site, kind,
            TipQualificationProcedure.begin(
                place, rig, probe.design, store, tip, sphere, now, who=who, temperature_c=warm,
                cone=cone, nominal_mm=_diameter(values["nominal"]), cameras=cameras,
                hold_s=probe.hold_s,
            ),
        )  # fmt: skip
    return opened_probe_session(
        site, kind,
        TipCheckProcedure.begin(
            place, rig, probe.design, store, tip, sphere, now, who=who, temperature_c=warm,
            cone=cone, cameras=cameras, hold_s=probe.hold_s,
        ),
    )  # fmt: skip


def resumed_probe_session(site: WizardSite, kind: Kind, path: Path) -> ShownProcedure:
    """Return the procedure of a session file."""
    probe, folder = probe_site_of(site)
    rig = running_rig(site)
    if kind is Kind.PIVOT:
        return resumed_pivot(path, rig, probe.design, folder)
    resumes = (
        TipQualificationProcedure.resume if kind is Kind.QUALIFICATION else TipCheckProcedure.resume
    )
    return resumes(
        path, rig, probe.design, ProbeStore(folder), cameras=_cameras(site.store),
        hold_s=probe.hold_s,
    )  # fmt: skip


def resumed_pivot(path: Path, rig: Rig, design: ProbeBody, folder: Path) -> PivotProcedure:
    """Return the procedure of a session file; also what a process that calculates begins with."""
    return PivotProcedure.resume(path, rig, design, ProbeStore(folder))


def opened_probe_session(site: WizardSite, kind: Kind, procedure: ShownProcedure) -> Opened:
    """Return a procedure with what calculates its result."""
    (probe, folder), rig = probe_site_of(site), running_rig(site)
    if kind is not Kind.PIVOT:
        return Opened(procedure, rig, DirectCalculation(procedure))
    again = partial(resumed_pivot, procedure.base.session, rig, probe.design, folder)
    return Opened(procedure, rig, ProcessCalculation(procedure, again))


def _known_tips(site: WizardSite) -> tuple[str, ...]:
    """Return the names of the tips that were calibrated, the mounted one first."""
    if site.probe is None or site.probe.store is None:
        return ()
    store = ProbeStore(site.probe.store)
    return tuple(sorted(store.tips, key=lambda tip: tip != store.mounted))


def _cameras(folder: Path | None) -> CalibrationStore | None:
    return None if folder is None else CalibrationStore(folder)


def _cone(text: str) -> ArtefactUse | None:
    if not text.strip():
        return None
    return ArtefactUse(
        name=text.strip(), serial="", certificate="", certificate_sha256="", due_utc=""
    )


def _diameter(text: str) -> float | None:
    if not text.strip():
        return None
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError as error:
        raise InputError(
            "wizard.diameter",
            f"The diameter of the ball is {text.strip()!r}, which is no number.",
            "Write it in millimetres.",
        ) from error
    return value
