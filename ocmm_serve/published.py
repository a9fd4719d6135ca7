"""Facts of a station for other programs: state, results, calibrations, corrections; read-only.

The state comes from the live stream of a station, results are job files as `ocmm report` has them,
so that nothing is computed where points are measured. `PublishedFacts` is replaced as a whole: a
slow reader misses versions and delays nothing.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from enum import IntEnum
from pathlib import Path
from typing import Any, Literal

import msgspec

from ocmm_core.calibration import records
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import OcmmError
from ocmm_core.export import EXPORTERS
from ocmm_core.export import report as reports
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_core.inspection.finished import SUFFIX, ReopenedJob, reopen_job
from ocmm_machine import Machine
from ocmm_serve.site import PublishedPlaces, stop_event

MOST_RESULTS = 50
"""Latest jobs that are published."""
_OFFLINE = "The live stream of the station is not connected."
_OUT = ("FAILED", "NOT READY")
_NO_VERDICT: dict[str, Any] = {
    "part": None, "verdict": None, "complete": None, "missing": (), "not_conform": (),
    "not_proven": (),
}  # fmt: skip
_LONGEST_LINE = 4 * 1024 * 1024
_POLL_S = 1.0
_EQUIPMENT_TURNS = 10
"""Polls between two readings of records and register."""
_NICE = 5
"""Behind the measuring, which may run on this computer."""
_LOOK_S = 0.1
_END_S = 30.0
"""s: reading a large job."""


class ResultEvaluation(IntEnum):
    """Verdict in the words of OPC UA; NOT PROVEN is NOT_DECIDABLE."""

    UNDEFINED = 0
    OK = 1
    NOT_OK = 2
    NOT_DECIDABLE = 3


_EVALUATIONS = {
    "CONFORM": ResultEvaluation.OK, "NOT CONFORM": ResultEvaluation.NOT_OK,
    "NOT PROVEN": ResultEvaluation.NOT_DECIDABLE,
}  # fmt: skip


def evaluation_of(verdict: str | None) -> ResultEvaluation:
    """Return the evaluation of a verdict; OK for CONFORM only."""
    return _EVALUATIONS.get(verdict or "", ResultEvaluation.UNDEFINED)


class StateFacts(msgspec.Struct, frozen=True, kw_only=True):
    """State of the station and its job; null while unknown."""

    online: bool = False
    """Whether the live stream is connected."""
    status: str | None = None
    """READY, MEASURING, NOT READY, INACCURATE, LOST or FAILED."""
    reason: str = _OFFLINE
    simulated: bool | None = None
    job: str = ""
    part: str | None = None
    """Verdict on the part; null while points are evaluated."""
    verdict: str | None = None
    complete: bool | None = None
    missing: tuple[str, ...] = ()
    not_conform: tuple[str, ...] = ()
    not_proven: tuple[str, ...] = ()

    @property
    def in_service(self) -> bool:
        """Return whether points can be recorded; the probe may be out of sight."""
        return self.status is not None and self.status not in _OUT


class CalibrationFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Calibration of the cameras, or of a tip of the probe."""

    of: Literal["cameras", "tip"]
    name: str
    status: str = "NONE"
    """VALID, DUE, EXPIRED, SUSPECT, UNUSABLE; NONE without a record."""
    reason: str = ""
    usable: bool = False
    made_utc: str = ""
    due_utc: str = ""


class CorrectionFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Last change of an offset of a machine tool: value in the control before and after."""

    machine: str
    offset: str
    unit: Literal["mm", "deg"]
    what: Literal["corrected", "undone", "stated"]
    before: float
    after: float
    expanded: float | None
    """U of the change; null if not computed."""
    characteristics: tuple[str, ...]
    job: str
    by: str
    made_utc: str
    practice: bool


@dataclass(frozen=True, slots=True)
class PublishedResult:
    """A job, as its report has it, without raw observations."""

    report: reports.ReportFile
    evaluation: ResultEvaluation
    partial: bool
    """The job is not complete, or the plan lacks requirements."""

    @property
    def json(self) -> bytes:
        """Return the report, schema ``ocmm.report/1``."""
        return msgspec.json.encode(self.report)

    @property
    def verdict_text(self) -> str:
        """Return the verdict with the states of the report, such as SIMULATED."""
        part = self.report.part_verdict
        return ", ".join(("" if part is None else part.word, *self.report.state))


@dataclass(frozen=True, slots=True)
class PublishedFacts:
    """Everything at one moment; `version` grows by one with every change."""

    version: int = 0
    state: StateFacts = field(default_factory=StateFacts)
    results: tuple[PublishedResult, ...] = ()
    """Oldest first."""
    calibrations: tuple[CalibrationFacts, ...] = ()
    corrections: tuple[CorrectionFacts, ...] = ()


def result_of(job: ReopenedJob) -> PublishedResult:
    """Return the result of a job; OcmmError if it cannot be reported."""
    data = reports.report_of_job(job)
    contents = EXPORTERS["json"].contents((data,), reports.polyworks_profile())
    report = reports.read_report(next(iter(contents.values())))
    short = msgspec.structs.replace(report, observations=(), taken_back=())
    shown = data.part.shown_as
    evaluation = evaluation_of(None if shown is None else shown.value)
    if evaluation is ResultEvaluation.OK and not set(data.states) <= {SIMULATED}:
        evaluation = ResultEvaluation.NOT_DECIDABLE
    return PublishedResult(short, evaluation, not data.part.complete or data.part.is_partial)


class PublishedStation:
    """Facts of a station, kept current by threads; `note` receives sentences about faults."""

    def __init__(self, places: PublishedPlaces, note: Callable[[str], None]) -> None:
        self._places, self._note = places, note
        self._lock, self._stopping = threading.Lock(), threading.Event()
        self._facts = PublishedFacts()
        self._told: set[str] = set()
        self._connection: socket.socket | None = None
        self._seen: dict[Path, tuple[object, PublishedResult | None]] = {}
        self._last: ReopenedJob | None = None
        works = [self._read_jobs] + ([] if places.stream is None else [self._follow_stream])
        self._threads = [threading.Thread(target=one, name="ocmm-published") for one in works]

    @property
    def facts(self) -> PublishedFacts:
        """Return the facts as of now."""
        return self._facts

    def start(self) -> None:
        """Follow the station; InputError: the document of corrections is unsuitable."""
        self._machine()
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Stop; a job that is being read is finished."""
        self._stopping.set()
        if self._connection is not None:
            # Its thread waits for a line.
            with contextlib.suppress(OSError):
                self._connection.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(_END_S)

    def _change(self, **changes: Any) -> None:
        with self._lock:
            changed = replace(self._facts, **changes)
            if changed != self._facts:
                self._facts = replace(changed, version=changed.version + 1)

    def _report(self, error: Exception) -> None:
        """Report a fault once."""
        told = error if isinstance(error, OcmmError) else contained(error, "Publishing")
        if str(told) not in self._told:
            self._told.add(str(told))
            self._note(str(told))

    # State.

    def _follow_stream(self) -> None:
        while not self._stopping.is_set():
            # Whatever ended a connection, the next one starts from nothing.
            with contextlib.suppress(OSError, LookupError, TypeError, msgspec.MsgspecError):
                self._follow()
            self._change(state=StateFacts())
            self._stopping.wait(_POLL_S)

    def _follow(self) -> None:
        with socket.create_connection(("127.0.0.1", self._places.stream or 0)) as connection:
            self._connection = connection
            lines = connection.makefile("rb")
            hello = msgspec.json.decode(lines.readline(_LONGEST_LINE))
            after = hello["last_seq"]
            connection.sendall(msgspec.json.encode({"resume": after, "poses": False}) + b"\n")
            state = StateFacts(
                online=True, reason="", simulated=hello["simulated"], job=hello["job"]
            )
            while not self._stopping.is_set():
                self._change(state=state)
                message = msgspec.json.decode(lines.readline(_LONGEST_LINE))
                kind, found = message["type"], {"job": message.get("job", state.job)}
                if kind in ("point", "annulled"):
                    after = message["seq"]
                new = kind in ("point", "annulled") or found["job"] != state.job
                # Verdicts before the last point are void.
                if new or (kind == "verdict" and message["part"] is None):
                    found |= _NO_VERDICT
                elif kind == "verdict" and message["after"] >= after:
                    found |= {name: message[name] for name in (*_NO_VERDICT, "simulated")}
                if kind == "status":
                    found |= {"status": message["status"], "reason": message["reason"]}
                state = msgspec.convert(msgspec.structs.asdict(state) | found, StateFacts)

    # Results and equipment.

    def _read_jobs(self) -> None:
        turn, waiting = 0, dict[Path, object]()
        while not self._stopping.is_set():
            try:
                now = self._files()
                # A file that changes is read when it has rested for a turn.
                rested = [path for path, state in now.items() if waiting.get(path) == state]
                waiting = now
                # The result of a job that has changed is void.
                seen = self._seen.items()
                self._seen = {path: one for path, one in seen if now.get(path) == one[0]}
                self._show_results()
                due = [path for path in rested if path not in self._seen]
                for path in due[::-1]:
                    self._seen[path] = now[path], self._result(path)
                    self._show_results()
                    if self._stopping.is_set():
                        return
                if turn % _EQUIPMENT_TURNS == 0 or due:
                    self._show_equipment()
            except Exception as error:
                self._report(error)
            turn += 1
            self._stopping.wait(_POLL_S)

    def _files(self) -> dict[Path, object]:
        """Return the latest jobs with size and time of the file and its log, oldest first."""
        found: dict[Path, tuple[int, ...]] = {}
        for path in files_of_folder(self._places.out, SUFFIX):
            log = path.with_name(f"{path.name}-wal")
            # A file may be gone meanwhile.
            with contextlib.suppress(OSError):
                states = [path.stat(), *([log.stat()] if log.exists() else [])]
                found[path] = tuple(n for one in states for n in (one.st_mtime_ns, one.st_size))
        latest = sorted(found, key=lambda path: found[path])[-MOST_RESULTS:]
        return {path: found[path] for path in latest}

    def _result(self, path: Path) -> PublishedResult | None:
        """Return the result of a job; None, and a sentence, if it cannot be read."""
        try:
            places, last = self._places, self._last
            job = reopen_job(path, places.probes, calibrations=places.calibrations)
            if last is None or job.head.created_utc >= last.head.created_utc:
                self._last = job
            return result_of(job)
        except Exception as error:
            self._report(error)
            return None

    def _show_results(self) -> None:
        by_id = {one.report.job.uuid: one for _, one in self._seen.values() if one is not None}
        results = sorted(by_id.values(), key=lambda one: one.report.job.created_utc)
        self._change(results=tuple(results))

    def _machine(self) -> Machine | None:
        document = self._places.corrections
        return None if document is None else Machine.open(document, self._places.records)

    def _show_equipment(self) -> None:
        if self._last is not None:
            self._change(calibrations=tuple(_calibrations(self._last, self._places)))
        try:
            machine = self._machine()
        except OcmmError:
            # An altered register proves nothing.
            self._change(corrections=())
            raise
        if machine is not None:
            self._change(corrections=tuple(_corrections(machine)))


def _calibrations(job: ReopenedJob, places: PublishedPlaces) -> Iterator[CalibrationFacts]:
    """Yield the present state of the equipment of a job; faults of records become states."""
    now, rig, probe = datetime.now(UTC), job.rig.name, job.body.name
    try:
        store = records.CalibrationStore(
            records.store_folder(places.calibrations or records.default_folder(), rig)
        )
        record = store.active()
        found = None if record is None else store.status_of(record, now, thorough=True)
        if record is None or found is None:
            yield CalibrationFacts(of="cameras", name=rig)
        else:
            yield CalibrationFacts(
                of="cameras", name=rig, status=found.state.value, reason=found.reason,
                usable=found.state.usable, made_utc=record.made_utc,
                due_utc=record.valid_until_utc,
            )  # fmt: skip
    except OcmmError as error:
        yield CalibrationFacts(of="cameras", name=rig, status="UNUSABLE", reason=error.what)
    try:
        tips = records.ProbeStore(
            records.probe_store_folder(places.probes or records.default_probe_folder(), probe)
        )
        overview = records.probe_overview(tips, now)
        if overview.fault or not overview.tips:
            status = "UNUSABLE" if overview.fault else "NONE"
            yield CalibrationFacts(of="tip", name=probe, status=status, reason=overview.fault)
        for one in overview.tips:
            last = one.qualification or one.calibration
            yield CalibrationFacts(
                of="tip", name=f"{probe}/{one.tip}", status=one.status.state.value,
                reason=one.status.reason, usable=one.status.state.usable, made_utc=last.made_utc,
                due_utc=one.due_utc,
            )  # fmt: skip
    except OcmmError as error:
        yield CalibrationFacts(of="tip", name=probe, status="UNUSABLE", reason=error.what)


def _corrections(machine: Machine) -> Iterator[CorrectionFacts]:
    """Yield the last change of each offset that was changed."""
    for offset in machine.document.offset:
        name = offset.name
        lines = (one for one in reversed(machine.register.items) if name in one.changed)
        if (line := next(lines, None)) is not None:
            yield CorrectionFacts(
                machine=machine.document.machine, offset=name, unit=offset.unit, what=line.what,
                before=line.before[name], after=line.after[name],
                expanded=line.expanded.get(name), characteristics=line.characteristics,
                job=line.job, by=line.who, made_utc=line.utc, practice=machine.practice,
            )  # fmt: skip


def publish_until_end(
    places: PublishedPlaces, note: Callable[[str], None], show: Callable[[PublishedFacts], None]
) -> None:
    """Show the facts of a station until Ctrl-C."""
    HOST.stand_back(_NICE)
    ended, station = stop_event(), PublishedStation(places, note)
    try:
        station.start()
        while not ended.wait(_LOOK_S):
            show(station.facts)
    finally:
        station.close()
