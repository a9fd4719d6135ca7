"""Site of a wizard: rig, probe, records and frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from datetime import datetime
from enum import Enum, auto
from pathlib import Path
from typing import Protocol, TypeVar

from ocmm_core.acceptance import read_temperature
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import Procedure, SessionSite
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, ProbeStore, rig_in_force
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError, InputError, OcmmError
from ocmm_core.tables import TableOptions
from ocmm_core.tracking import ProbeBody
from ocmm_core.typed_numbers import TEMPERATURE
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import read_number, tr
from ocmm_gui.wizards.pages import Tap, TemperatureReadings

C = TypeVar("C", bound=str)

SESSIONS = "sessions"
"""Session folder within the store."""


@dataclass(frozen=True, slots=True)
class ProbeWizardSite:
    """Site of wizards about the probe."""

    design: ProbeBody
    store: Path | None
    """Folder of its records; None if not kept."""
    tip: str = "1"
    blocker: tuple[str, str] = ("", "")
    """Why no records are kept, and the remedy; empty if they are."""
    hold_s: float = 0.5
    """Rest time before an automatic touch: a hand needs time to settle."""


@dataclass(frozen=True, slots=True)
class WizardSite:
    rig: Rig
    body: ProbeBody
    store: Path | None
    """Folder of the rig's calibrations; None if not kept."""
    who: str
    tap: Tap
    temperature_state: TemperatureReadings = tuple
    """Sensor temperatures, degrees Celsius, by camera; empty if unknown."""
    blocker: tuple[str, str] = ("", "")
    """Why no calibrations are kept, and the remedy; empty if they are."""
    probe: ProbeWizardSite | None = None
    practice: PracticeRoom | None = None
    """Practice with a virtual hand; None for real use."""

    def tap_for(self, procedure: Procedure, failed: Callable[[OcmmError], None]) -> Tap:
        """Return the frame source: a virtual hand in practice, otherwise the cameras."""
        if self.practice is None:
            return self.tap
        hand = self.practice.hand(procedure, failed)

        def practised(watcher: Callable[[FrameBlock], None] | None) -> None:
            # The robot continues in the background; its touches must not count.
            self.tap(None if watcher is None else _look_away)
            hand(watcher)

        return practised


class PracticeRoom(Protocol):
    """Practice at a virtual rig (`ocmm_sim.practice.Practice`)."""

    @property
    def cameras(self) -> Path:
        """Return the folder of the practised calibrations of the rig."""
        ...

    @property
    def probe(self) -> Path: ...

    @property
    def points(self) -> Path:
        """Return the list of reference points of the virtual machine."""
        ...

    def prepare(self, now: datetime) -> None:
        """Activate initial records; raise OcmmError if impossible."""
        ...

    def hand(self, procedure: Procedure, failed: Callable[[OcmmError], None]) -> Tap: ...


def practice_site(bridge: StationBridge, room: PracticeRoom) -> WizardSite:
    """Return a practice site: a virtual hand and separate folders."""
    site = site_of(bridge)
    tip = ProbeStore(room.probe).mounted or "1"
    # The hand rests exactly as long as a pose needs.
    probe = ProbeWizardSite(
        bridge.station.instruments.probe_in_use.design, room.probe, tip, hold_s=0.0
    )
    return replace(site, store=room.cameras, probe=probe, practice=room, blocker=("", ""))


def _look_away(block: FrameBlock) -> None:
    """Watch nothing."""


def site_of(bridge: StationBridge) -> WizardSite:
    station = bridge.station
    in_use = station.instruments.calibration_in_use
    blocker = (
        tr("The cameras use the rig document: no calibrations are stored."),
        tr("Choose real cameras, or a folder of camera records, in Settings (Instrument)."),
    )
    if in_use.fault is not None:
        blocker = (in_use.fault[1].what, in_use.fault[1].remedy)

    def temperature_state() -> tuple[float | None, ...]:
        report = station.looks.bus_report()
        return () if report is None else tuple(one.temperature_c for one in report.cameras)

    return WizardSite(
        rig=station.instruments.rig,
        body=station.instruments.body,
        store=None if in_use.store is None else in_use.store.folder,
        who=bridge.shown.job.operator,
        tap=bridge.station.maintenance.set_frame_tap,
        temperature_state=temperature_state,
        blocker=blocker,
        probe=_probe_site(bridge),
    )


def _probe_site(bridge: StationBridge) -> ProbeWizardSite:
    in_use = bridge.station.instruments.probe_in_use
    blocker = (
        tr("The probe uses its document: no records of it are stored."),
        tr("Choose real cameras, or a folder of tip records, in Settings (Instrument)."),
    )
    if in_use.store is None and in_use.fault is not None:
        blocker = (in_use.fault[1].what, in_use.fault[1].remedy)
    store = None if in_use.store is None else in_use.store.folder
    return ProbeWizardSite(in_use.design, store, in_use.tip or "1", blocker)


@dataclass(frozen=True, slots=True)
class UnfinishedSession:
    path: Path
    title: str
    """Start time, user, and status."""
    blocker: str = ""
    """Why it cannot be resumed; empty if it can."""


@dataclass(frozen=True, slots=True)
class OpenSession:
    """A procedure with the data of its pages."""

    procedure: Procedure
    site: SessionSite
    again: Callable[[], Procedure] | None = None
    """Resumes the session in a process that calculates; None: in a thread."""
    predict: Callable[[], None] | None = None
    """Predicts the quality of the result so far; None if unsupported."""


class Subject(Enum):
    """Subject of a wizard: determines its records and its page."""

    CAMERAS = auto()
    PROBE = auto()


def session_site(site: WizardSite, subject: Subject) -> SessionSite:
    """Return the site of a session; CalibrationError as `require_store`."""
    folder, rig = require_store(site, subject), running_rig(site)
    body, hold_s = site.body, 0.0
    if subject is Subject.PROBE and site.probe is not None:
        body, hold_s = site.probe.design, site.probe.hold_s
    return SessionSite(folder / SESSIONS, rig, body, folder, site.store, hold_s)


def require_store(site: WizardSite, subject: Subject) -> Path:
    """Return the record folder of a subject; raise CalibrationError if not kept."""
    folder, probe = store_of(site, subject), site.probe
    if folder is not None:
        return folder
    if subject is Subject.CAMERAS:
        raise CalibrationError("wizard.no_store", *site.blocker)
    what, remedy = (tr("No probe selected."), "") if probe is None else probe.blocker
    raise CalibrationError("wizard.no_probe_store", what, remedy)


def store_of(site: WizardSite, subject: Subject) -> Path | None:
    """Return the record folder of a subject; None if not kept."""
    if subject is Subject.CAMERAS:
        return site.store
    return None if site.probe is None else site.probe.store


def running_rig(site: WizardSite) -> Rig:
    """Return the rig with the calibration in force, or the one in use before."""
    record = None if site.store is None else CalibrationStore(site.store).active()
    # The frames of a tracker come by the calibration at the start of the program.
    if record is None or site.rig.markers is not None:
        return site.rig
    return rig_in_force(record, site.rig)


def named(values: Mapping[str, str]) -> str:
    """Return the user's name; raise InputError if empty."""
    who = values["who"].strip()
    if not who:
        raise InputError("wizard.who", "No name given.", "Enter your name in 'Done by'.")
    return who


def chosen(value: str, possible: tuple[C, ...]) -> C:
    return next(one for one in possible if one == value)


def given(values: Mapping[str, str], key: str, what: str) -> Path:
    """Return a required file; raise InputError if empty."""
    text = values[key].strip()
    if not text:
        raise InputError("wizard.missing", f"No file given for {what}.", "Name one.")
    return Path(text).expanduser()


def table_options(values: Mapping[str, str], key: str) -> TableOptions:
    """Return the statements of the import page about the table of a field."""
    return TableOptions(**{
        one.name: values.get(f"{key}.{one.name}", "") for one in fields(TableOptions)
    })  # fmt: skip


def table_values(key: str, options: TableOptions) -> dict[str, str]:
    """Return statements about a table as `table_options` reads them."""
    return {f"{key}.{name}": text for name, text in asdict(options).items()}


def temperature(values: Mapping[str, str], now: datetime) -> Temperature | None:
    """Return the temperature of a form with the uncertainty of its thermometer; None if empty.

    Without a typed number, a thermometer of the register is read by its source.
    """
    text, stated = values.get("temperature", ""), values.get("thermometer", "")
    return read_temperature(read_number(TEMPERATURE, text) if text.strip() else None, stated, now)
