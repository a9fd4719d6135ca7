"""What a wizard works on: rig, probe, store and frames; how its sessions begin and go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TypeVar, get_args

from ocmm_core.calibration.artefacts import load_bar, load_sphere
from ocmm_core.calibration.history import CalibrationStore
from ocmm_core.calibration.procedure import Decision, Kind
from ocmm_core.calibration.procedure_known_points import KnownPointsProcedure
from ocmm_core.calibration.procedure_relocation import RelocationProcedure
from ocmm_core.calibration.procedure_verification import VerificationProcedure
from ocmm_core.calibration.records import rig_from_record
from ocmm_core.calibration.reference_points import load_reference_points
from ocmm_core.calibration.relocation_data import GeometryMode, LensMode
from ocmm_core.calibration.relocation_state import World
from ocmm_core.calibration.session_events import sessions
from ocmm_core.camera.rig import Rig
from ocmm_core.errors import CalibrationError, InputError, OcmmError
from ocmm_core.tracking.body import ProbeBody
from ocmm_gui.bridge import StationBridge
from ocmm_gui.wizards.calculation import ProcessCalculation
from ocmm_gui.wizards.driver import Calculation, ShownProcedure, Tap, Warmth
from ocmm_gui.wizards.forms import FIELDS, WHO, Field

C = TypeVar("C", bound=str)

_PAST = ("session.rig", "session.empty")
"""Codes of sessions that nobody misses: of a calibration that is no longer in force, or without
anything in them."""

SESSIONS = "sessions"
"""Folder of the sessions in that of the store."""


@dataclass(frozen=True, slots=True)
class WizardSite:
    """Where wizards work.

    Attributes
    ----------
    rig
        What is measured with.
    body
        The probe.
    store
        Folder of the rig's calibrations; None where none are kept.
    who
        Name that is proposed.
    tap
        The frames.
    warmth
        How warm the sensors are now, degrees Celsius, camera by camera; empty where nobody knows.
    obstacle
        Why no calibrations are kept, and what to do; empty where they are.
    """

    rig: Rig
    body: ProbeBody
    store: Path | None
    who: str
    tap: Tap
    warmth: Warmth = tuple
    obstacle: tuple[str, str] = ("", "")


def site_of(bridge: StationBridge) -> WizardSite:
    """Return the site of a running inspection."""
    station = bridge.station
    in_use = station.calibration_in_use
    obstacle = (
        "The cameras are taken to be as the rig document says: no calibrations are kept.",
        "Start the program with --calibrations FOLDER, or with real cameras.",
    )
    if in_use.fault is not None:
        obstacle = (in_use.fault[1].what, in_use.fault[1].remedy)

    def warmth() -> tuple[float | None, ...]:
        report = station.bus_report()
        return () if report is None else tuple(one.temperature_c for one in report.cameras)

    return WizardSite(
        rig=station.rig,
        body=station.body,
        store=None if in_use.store is None else in_use.store.folder,
        who=bridge.job().operator,
        tap=bridge.show_frames_to,
        warmth=warmth,
        obstacle=obstacle,
    )


@dataclass(frozen=True, slots=True)
class Offer:
    """A session that was not ended.

    Attributes
    ----------
    path
        Its file.
    title
        When it was begun and by whom, and where it stands.
    obstacle
        Why it cannot go on; empty where it can.
    """

    path: Path
    title: str
    obstacle: str = ""


@dataclass(frozen=True, slots=True)
class Opened:
    """A procedure with everything that its pages need.

    Attributes
    ----------
    procedure
        Begun or resumed.
    rig
        What it starts from.
    calculation
        Of its result.
    predict
        Works out how good the result would be by now; None where nothing does.
    """

    procedure: ShownProcedure
    rig: Rig
    calculation: Calculation
    predict: Callable[[], None] | None = None


class DirectCalculation:
    """A calculation that is over at once."""

    def __init__(self, procedure: ShownProcedure) -> None:
        self._procedure = procedure

    def run(self) -> None:
        """Calculate."""
        self._procedure.compute()

    def cancel(self) -> None:
        """Do nothing: there is never time for it."""


def fields(site: WizardSite, kind: Kind) -> tuple[Field, ...]:
    """Return what is filled in before a session of a kind begins."""
    return tuple(
        Field(one.key, one.label, one.tip, site.who) if one is WHO else one
        for one in FIELDS[kind]
    )


def begin(site: WizardSite, kind: Kind, values: Mapping[str, str], now: datetime) -> Opened:
    """Begin a session with what was filled in.

    Raises
    ------
    OcmmError
        A document cannot be used, something is missing, or the session cannot be stored.
    """
    folder = store_folder_of(site)
    store = CalibrationStore(folder)
    rig = _running(site, store)
    who = values["who"].strip()
    if not who:
        raise InputError(
            "wizard.who", "Nobody is named who does this.", "Write your name into 'Done by'."
        )
    temperature = _temperature(values["temperature"])
    if kind is Kind.KNOWN_POINTS:
        points = load_reference_points(_given(values, "points", "the list of reference points"))
        return _opened(
            site, kind, rig, folder,
            KnownPointsProcedure.begin(
                folder / SESSIONS, rig, store, points, now, who=who, temperature_c=temperature
            ),
        )  # fmt: skip
    bar = load_bar(_given(values, "bar", "the document of the length bar"))
    if kind is Kind.RELOCATION:
        control = None
        if values["world"] == "points":
            control = load_reference_points(_given(values, "control", "the control points"))
        return _opened(
            site, kind, rig, folder,
            RelocationProcedure.begin(
                folder / SESSIONS, rig, site.body, store, bar, now, who=who,
                temperature_c=temperature, control=control,
                world=_chosen(values["world"], get_args(World)),
                lens=_chosen(values["lens"], get_args(LensMode)),
                geometry=_chosen(values["geometry"], get_args(GeometryMode)),
            ),
        )  # fmt: skip
    sphere = values["sphere"].strip()
    return _opened(
        site, kind, rig, folder,
        VerificationProcedure.begin(
            folder / SESSIONS, rig, site.body, store, bar, now, who=who,
            temperature_c=temperature, spheres=(load_sphere(Path(sphere)),) if sphere else (),
        ),
    )  # fmt: skip


def resume(site: WizardSite, kind: Kind, path: Path) -> Opened:
    """Go on with a session; raise OcmmError where that is not possible."""
    folder = store_folder_of(site)
    rig = _running(site, CalibrationStore(folder))
    return _opened(site, kind, rig, folder, resumed(kind, path, rig, site.body, folder))


def resumed(kind: Kind, path: Path, rig: Rig, body: ProbeBody, folder: Path) -> ShownProcedure:
    """Return the procedure of a session file; also what a process that calculates begins with."""
    store = CalibrationStore(folder)
    if kind is Kind.KNOWN_POINTS:
        return KnownPointsProcedure.resume(path, rig, store)
    if kind is Kind.RELOCATION:
        return RelocationProcedure.resume(path, rig, body, store)
    return VerificationProcedure.resume(path, rig, body, store)


def offers(site: WizardSite, kind: Kind) -> tuple[Offer, ...]:
    """Return the sessions of a kind that were not ended, the newest first."""
    if site.store is None:
        return ()
    found = []
    for path in sessions(site.store / SESSIONS, kind):
        try:
            base = resume(site, kind, path).procedure.base
        except OcmmError as error:
            if error.code not in _PAST:
                found.append(Offer(path, path.name, f"{error.what} {error.remedy}"))
            continue
        # What was accepted, but is not in the store, was interrupted just before it got there.
        if not (base.stored or base.decision is Decision.KEPT):
            begun = datetime.fromisoformat(base.begun_utc).astimezone()
            step = base.step
            count = f", {step.done} of {step.wanted}" if step.wanted else ""
            found.append(
                Offer(path, f"{begun:%Y-%m-%d %H:%M}, {base.who}: {step.title.lower()}{count}")
            )
    return tuple(found)


def store_folder_of(site: WizardSite) -> Path:
    """Return where the calibrations are kept; raise CalibrationError where they are not."""
    if site.store is None:
        raise CalibrationError("wizard.no_store", *site.obstacle)
    return site.store


def _running(site: WizardSite, store: CalibrationStore) -> Rig:
    """Return the rig with the calibration in force, or what is measured with before the first."""
    record = store.active()
    return site.rig if record is None else rig_from_record(record)


def _opened(
    site: WizardSite, kind: Kind, rig: Rig, folder: Path, procedure: ShownProcedure
) -> Opened:
    again: Callable[[], ShownProcedure] = partial(
        resumed, kind, procedure.base.session, rig, site.body, folder
    )
    if kind is Kind.VERIFICATION:
        return Opened(procedure, rig, DirectCalculation(procedure))
    predict = procedure.predict if isinstance(procedure, RelocationProcedure) else None
    return Opened(procedure, rig, ProcessCalculation(procedure, again), predict)


def _chosen(value: str, possible: tuple[C, ...]) -> C:
    """Return a choice as what it stands for."""
    return next(one for one in possible if one == value)


def _given(values: Mapping[str, str], key: str, what: str) -> Path:
    text = values[key].strip()
    if not text:
        raise InputError("wizard.missing", f"There is no file for {what}.", "Name one.")
    return Path(text).expanduser()


def _temperature(text: str) -> float | None:
    if not text.strip():
        return None
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError as error:
        raise InputError(
            "wizard.temperature",
            f"The temperature is {text.strip()!r}, which is no number.",
            "Write it in degrees Celsius, or leave it empty.",
        ) from error
    if not -20.0 <= value <= 60.0:
        raise InputError(
            "wizard.temperature",
            f"The temperature is {value:g} °C.",
            "Write that of the room, in degrees Celsius.",
        )
    return value
