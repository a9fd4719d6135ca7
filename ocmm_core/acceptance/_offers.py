"""Choices before a test: procedures, artefacts (unusable ones with reason), open tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import cast

from ocmm_core import typed_numbers
from ocmm_core.acceptance import _register as register
from ocmm_core.acceptance._guards import EarlierUse, artefact_findings
from ocmm_core.acceptance._kinds import kind_of
from ocmm_core.acceptance._procedure import ProcedureDocument, load_procedure, procedure_files
from ocmm_core.acceptance._register import ArtefactKind
from ocmm_core.acceptance._result import AcceptanceRecord, InstrumentState, UsedArtefact
from ocmm_core.acceptance._session import AcceptanceSession, load_signed_record
from ocmm_core.acceptance._situation import Stage
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.seals import SealState

SESSIONS, RECORDS = "sessions", "records"
MOST_SHOWN, _NEWEST = 200, 4
MOST_READ = 100
"""Maximum number of sessions read, newest first: each takes milliseconds to hash."""
_TEXTS = (
    "id", "name", "maker", "serial", "laboratory", "certificate", "certificate_sha256", "due_utc",
    "supports", "source",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ProcedureOffer:
    procedure: ProcedureDocument
    file: Path
    sha256: str
    roles: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ArtefactOffer:
    name: str
    """Id in the register, or name in the virtual rig."""
    used: UsedArtefact
    refusal: str = ""
    """Why it is unusable, and the remedy; empty if usable."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OpenTest:
    """A started test without stored verdict."""

    path: Path
    title: str
    who: str
    done: int
    wanted: int
    blocker: str = ""
    """Why it cannot be resumed; empty if it can."""


@dataclass(frozen=True, slots=True)
class FinishedTest:
    file: Path
    record: AcceptanceRecord
    signer: SealState

    @property
    def states(self) -> tuple[str, ...]:
        """Return the status words before the verdict: SIMULATED, NOT SIGNED, ..."""
        signed = () if self.signer.sound else (self.signer.word.value,)
        return (*self.record.instrument.states, *signed)


def offered_procedures(stage_of: InstrumentState, seed: int = 0) -> tuple[ProcedureOffer, ...]:
    """Return the shipped procedures with their requirements."""
    found = []
    for path in procedure_files().values():
        procedure, sha256 = load_procedure(path)
        roles = kind_of(Stage(procedure, stage_of, (), seed)).roles
        found.append(ProcedureOffer(procedure, path, sha256, roles))
    return tuple(found)


def offered_artefacts(
    stage: Stage,
    candidates: Iterable[tuple[str, UsedArtefact]],
    now: datetime,
    temperature: Temperature,
    earlier: EarlierUse | None = None,
) -> tuple[ArtefactOffer, ...]:
    """Return the needed artefacts for a test, usable first; others with the reason."""
    offers = []
    for name, used in candidates:
        if used.role not in kind_of(stage).roles:
            continue
        found = artefact_findings(stage, used, now, temperature, earlier or EarlierUse())
        refused = [f"{one.what} {one.remedy}" for one in found if one.refuses]
        warned = tuple(one.what for one in found if not one.refuses)
        offers.append(ArtefactOffer(name, used, refused[0] if refused else "", warned))
    return tuple(sorted(offers, key=lambda one: bool(one.refusal)))


def open_tests(
    folder: Path, instrument: InstrumentState, most: int = MOST_READ
) -> tuple[OpenTest, ...]:
    """Return unfinished tests, newest first; the last entry states if there are more."""
    found = []
    paths = sorted(files_of_folder(folder / SESSIONS, ".chain"), key=_made, reverse=True)
    for index, path in enumerate(paths[:most]):
        try:
            session = AcceptanceSession.resume(path)
        except OcmmError as error:
            found.append(OpenTest(path, path.name, "", 0, 0, f"{error.what} {error.remedy}"))
            continue
        state = session.state
        if state.abandoned is not None:
            continue
        # Only the newest can have been interrupted between verdict and record.
        if state.finished is not None and (index >= _NEWEST or _is_stored(folder, session)):
            continue
        begun, done = state.begun, sum(len(one) for one in state.taken)
        wanted = done + state.missing()
        title = state.stage.procedure.title
        one = OpenTest(path, title, begun.made_by, done, wanted)
        changed = _changed(begun.instrument, instrument)
        found.append(replace(one, blocker=changed) if changed else one)
    if len(paths) > most:
        why = (
            f"{len(paths) - most} older sessions were not looked at. To go on with one of them, "
            f"begin it again, or move finished ones out of {folder / SESSIONS}."
        )
        found.append(OpenTest(folder / SESSIONS, "Older tests", "", 0, 0, why))
    return tuple(found)


def _made(path: Path) -> float:
    return path.stat().st_mtime


def _is_stored(folder: Path, session: AcceptanceSession) -> bool:
    finished, _ = finished_tests(folder, _NEWEST)
    return any(one.record.chain_head == session.head for one in finished)


def _changed(then: InstrumentState, now: InstrumentState) -> str:
    """Return why a test of one instrument cannot be resumed with another, or empty."""
    for field, what in (
        ("rig", "another rig"), ("calibration", "another calibration of the cameras"),
        ("probe", "another probe"), ("tip_record", "another calibration of the tip"),
        ("simulated", "another source of frames"),
    ):  # fmt: skip
        if getattr(then, field) != getattr(now, field):
            return f"It was begun with {what}. Begin a new test."
    return ""


def finished_tests(
    folder: Path, most: int = MOST_SHOWN
) -> tuple[tuple[FinishedTest, ...], tuple[str, ...]]:
    """Return the records of a folder, newest first, and why others are unreadable."""
    found, unread = [], []
    try:
        paths = sorted(files_of_folder(folder / RECORDS, ".json"), key=_made, reverse=True)
    except InputError as error:
        return (), (error.what,)
    for path in paths[:most]:
        try:
            loaded = load_signed_record(path)
            found.append(FinishedTest(path, loaded.record, loaded.signer))
        except OcmmError as error:
            unread.append(error.what)
    found.sort(key=lambda one: one.record.ended_utc, reverse=True)
    return tuple(found), tuple(unread)


def typed_entry(fields: Mapping[str, str], *, comma: bool = False) -> register.ArtefactEntry:
    """Return a register entry from typed fields or those of a certificate.

    Parameters
    ----------
    fields
        Texts by name: those of `ArtefactEntry`; ``sizes`` separated by blanks or semicolons, mm;
        ``due_utc`` as a date. Empty fields with a default use it.
    comma
        The form shows numbers with a decimal comma.

    Raises
    ------
    InputError
        A field is not a number within its range, or implausible.
    """

    def read(name: str, text: str, field: typed_numbers.NumberField) -> float:
        return replace(field, words=f"'{name}'").read(text, comma=comma)

    def number(name: str, field: typed_numbers.NumberField) -> float:
        text = fields.get(name, "").strip()
        if not text and name in ("expanded_per_length", "form"):
            return 0.0
        return read(name, text, field)

    given = {name: fields.get(name, "").strip() for name in _TEXTS}
    kinds = register.ARTEFACT_KINDS
    if fields.get("kind") not in kinds:
        raise InputError(
            "artefact.kind", f"The kind is {fields.get('kind')!r}.", f"Give {', '.join(kinds)}."
        )
    sizes = tuple(
        read("sizes", one, typed_numbers.SIZE)
        for one in fields.get("sizes", "").replace(";", " ").split()
    )
    entry = register.ArtefactEntry(
        schema=register.ARTEFACT_SCHEMA, unit="mm", kind=cast("ArtefactKind", fields["kind"]),
        sizes=sizes, expanded=number("expanded", typed_numbers.EXPANDED),
        form=number("form", typed_numbers.FORM),
        expanded_per_length=number("expanded_per_length", typed_numbers.PER_LENGTH),
        expansion=number("expansion", typed_numbers.EXPANSION),
        expansion_sigma=number("expansion_sigma", typed_numbers.EXPANSION_SIGMA),
        id=given["id"], name=given["name"], maker=given["maker"], serial=given["serial"],
        laboratory=given["laboratory"], certificate=given["certificate"],
        certificate_sha256=given["certificate_sha256"], due_utc=given["due_utc"],
        supports=given["supports"], source=given["source"] or "typed",
    )  # fmt: skip
    register.check_entry(entry, "artefact")
    return entry
