"""Header and conditions of a job.

Operator, serial number, order and batch are entered before the first point. Conditions of the
points (calibration, probe, temperatures and limits) are events of the job file, each valid from
then on. Reasons against the proof of a job hold for good.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_core.acceptance import LoggedTemperature
from ocmm_core.ambient import TypedRoom
from ocmm_core.documents import shortened
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.inspection import evaluation
from ocmm_core.inspection.plan import NotedRoom, environment_doubt, note_room_in, noted_rooms
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import CLIMATE_EVENT, Climate, climate_of_text, record_text
from ocmm_core.names import label_fault
from ocmm_core.options import DEFAULT_SERIAL
from ocmm_core.storage import JobEvent, JobHead, event_value

HEADER_EVENT = "header"
"""Event for fields that the head of a job file lacks."""

NOT_GIVEN = DEFAULT_SERIAL


class _Written(msgspec.Struct, frozen=True):
    order: str = ""
    batch: str = ""


def check_header(header: evaluation.JobHeader) -> None:
    """Raise InputError if a name of the header is no label (`names.label_fault`).

    Only order and batch may be missing; ``-`` is an unknown serial number.
    """
    fields = {
        "operator": header.operator,
        "part": header.part,
        "serial number": header.serial,
        "order": header.order,
        "batch": header.batch,
    }
    for field, name in fields.items():
        missing = name == NOT_GIVEN or (name == "" and field in ("order", "batch"))
        if not missing and (fault := label_fault(name)):
            raise InputError(
                "header.name", f"The {field} {shortened(name)} {fault}.", f"Correct the {field}."
            )


def header_text(header: evaluation.JobHeader) -> str:
    return msgspec.json.encode(_Written(header.order, header.batch)).decode()


def header_of(head: JobHead, events: Sequence[JobEvent]) -> evaluation.JobHeader:
    """Return the header of a job file; StorageError if its event cannot be read."""
    texts = [event.text for event in events if event.kind == HEADER_EVENT]
    beside = event_value(HEADER_EVENT, texts[-1], _Written) if texts else _Written()
    return evaluation.JobHeader(head.operator, head.part, head.serial, beside.order, beside.batch)


_CALIBRATION, _PROBE, _UNCALIBRATED = "calibration", "probe", "uncalibrated"
_SIMULATED = "simulated"
_CAMERAS = "cameras"


def is_simulated(events: Sequence[JobEvent]) -> bool:
    """Return whether points of a job may have come from a virtual rig; once is for good."""
    return any(event.kind == _SIMULATED for event in events)


CLIENT_EVENT = "client"
"""Event of a job: what a client asked and was answered, JSON (docs/integrator/ippdme.md)."""


class Conditions:
    """Conditions of a job; thread-safe.

    `ledger`: its view is invalidated by changes. StorageError of methods that store if not durable;
    MeasuringError if existing points have other temperatures.
    """

    def __init__(
        self, ledger: JobLedger, options: evaluation.SessionOptions, *, begun: bool
    ) -> None:
        self._ledger = ledger
        self._options = options
        events = ledger.job.events()
        self._last = {event.kind: event.text for event in events}
        self._rooms = noted_rooms(events)
        self._logged: tuple[str, float, bool] | None = None
        self._compared = "thesis" in (*evaluation.methods_used(events), options.method)
        if begun:
            self._require_same_climate()

    @property
    def unproven(self) -> str:
        """Return why the job proves nothing; empty if it does."""
        return self._last.get(_UNCALIBRATED, evaluation.FOR_COMPARISON if self._compared else "")

    @property
    def simulated(self) -> bool:
        """Return whether points may be from a virtual rig; once is for good."""
        return _SIMULATED in self._last

    def note_origin(self, *, simulated: bool) -> None:
        """Store that points come from a virtual rig, for good; nothing if real."""
        with self._ledger.lock:
            if simulated and not self.simulated:
                self._store(
                    _SIMULATED, "Points come from a virtual rig: no real part was measured."
                )
                self._ledger.view = None

    @property
    def camera_doubts(self) -> tuple[str, ...]:
        """Return unproven properties of the job's cameras, in sentences; once is for good."""
        return tuple(self._last.get(_CAMERAS, "").splitlines())

    def note_cameras(self, doubts: Sequence[str]) -> None:
        """Store unproven properties of the cameras, for good."""
        with self._ledger.lock:
            known = self.camera_doubts
            told = tuple(dict.fromkeys((*known, *doubts)))
            if told != known:
                self._store(_CAMERAS, "\n".join(told))
                self._ledger.view = None

    def note_calibration(self, calibration: str, probe: str, unproven: str) -> None:
        """Store the calibration and probe of the points from now on.

        Words, with the hashes of records. `unproven`: why this job proves nothing, for good, or
        empty.
        """
        with self._ledger.lock:
            self._store(_CALIBRATION, calibration)
            self._store(_PROBE, probe)
            if unproven:
                self._store(_UNCALIBRATED, unproven)
            self._ledger.view = None

    def note_client(self, text: str) -> None:
        """Store a request or an answer of another program that measures by this job."""
        with self._ledger.lock:
            self._ledger.job.append_event(CLIENT_EVENT, text)

    def note_climate(self) -> None:
        """Store temperatures and switches if changed."""
        text = record_text(self._options.climate.record())
        with self._ledger.lock:
            if self._last.get(CLIMATE_EVENT) != text:
                self._store(CLIMATE_EVENT, text)

    def note_limits(self) -> None:
        text = evaluation.limits_text(self._options)
        with self._ledger.lock:
            if self._last.get(evaluation.LIMITS_EVENT) != text:
                self._store(evaluation.LIMITS_EVENT, text)

    @property
    def rooms(self) -> tuple[NotedRoom, ...]:
        """Return the ambient readings, oldest first."""
        return self._rooms

    @property
    def room_doubt(self) -> str:
        """Return why ambient conditions invalidate the job; empty if they do not."""
        ledger = self._ledger
        return environment_doubt(
            ledger.plan.environment, self._rooms, ledger.points.last_number,
            complete=not ledger.progress.active,
        )  # fmt: skip

    def note_room(self, typed: TypedRoom, who: str = "") -> None:
        """Store current ambient readings; InputError if invalid."""
        ledger = self._ledger
        with ledger.lock:
            note_room_in(ledger.job, typed, who)
            self._rooms = noted_rooms(ledger.job.events())
            ledger.view = None

    def is_logged(self, read: LoggedTemperature) -> bool:
        """Return whether a reading is stored: for this feature, and to a tenth of a kelvin."""
        with self._ledger.lock:
            return self._logged_state(read) == self._logged

    def note_logged(self, read: LoggedTemperature) -> None:
        """Store a logged reading or its doubt when a feature has ended or the reading changed."""
        ledger = self._ledger
        with ledger.lock:
            state = self._logged_state(read)
            if state == self._logged:
                return
            note_room_in(ledger.job, TypedRoom(room=read.note), read.name, read.doubt)
            self._logged, self._rooms = state, noted_rooms(ledger.job.events())
            ledger.view = None

    def _logged_state(self, read: LoggedTemperature) -> tuple[str, float, bool]:
        shown = 0.0 if read.sample is None else round(read.sample.celsius, 1)
        return self._ledger.progress.active, shown, bool(read.doubt)

    def _store(self, kind: str, text: str) -> None:
        self._ledger.job.append_event(kind, text)
        self._last[kind] = text

    def _require_same_climate(self) -> None:
        stored = self._last.get(CLIMATE_EVENT)
        before = climate_of_text(stored) if stored is not None else Climate()
        if before.record() != self._options.climate.record():
            raise MeasuringError(
                "session.temperature",
                f"{self._ledger.job.path}: its points were taken with other temperature "
                f"settings. {before.summary}",
                "Continue with the same settings, or start a new job.",
            )
