"""What the archive keeps of a job: its rows, as they are handed over and stored."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.tolerances.decisions import PartWord, Verdict

JobState = Literal["finished", "paused", "open"]
STATES: tuple[JobState, ...] = ("finished", "paused", "open")
UseKind = Literal["calibration", "tip", "probe", "artefact", "rig", "plan", "reference"]
USES: tuple[UseKind, ...] = (
    "calibration", "tip", "probe", "artefact", "rig", "plan", "reference",
)  # fmt: skip
VERDICTS = tuple(one.value for one in Verdict)
PART_VERDICTS = tuple(one.value for one in PartWord)

LONGEST_NAME = 300
LONGEST_SENTENCE = 3000
MOST_RESULTS = 20_000
LARGEST_CONTENT = 256 << 20
"""Bytes of a job file that is archived; one of 100,000 points has less."""


class ResultRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One characteristic of one job.

    Attributes
    ----------
    position
        In the plan, from 0.
    characteristic, kind
        As in the plan.
    unit
        Of all numbers here: mm or deg.
    nominal, low, high
        Limits of the value; None where there is none.
    value, uncertainty
        As they may be reported, U (95 %); None where there is no trustworthy value.
    verdict
        One of `VERDICTS`.
    why_not
        Why the value counts in no statistic; empty where it does.
    """

    position: int
    characteristic: str
    kind: str
    unit: str
    nominal: float
    low: float | None
    high: float | None
    value: float | None
    uncertainty: float | None
    verdict: str
    why_not: str


class UseRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that a job was measured with.

    Attributes
    ----------
    kind
        What it is.
    identity
        SHA-256 of its record or document; the serial number of an artefact.
    name
        What people call it.
    """

    kind: UseKind
    identity: str
    name: str


class JobRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One job as it stood when it was handed over.

    Attributes
    ----------
    job_uuid, steps, head
        Which job, how many rows its audit has, and the hash of the last one.
    sha256, size
        Of the file.
    station
        Where it was measured.
    state
        Finished, paused, or left open.
    part, serial, order_name, batch, operator
        As entered.
    plan, plan_sha256
        Name of the plan, and hash of its document.
    program
        Version that made the file.
    created_utc, changed_utc
        Begun, and what happened last, ISO 8601 text in UTC.
    rig, calibration
        Name of the rig, and hash of its record; the latter is empty where it was not calibrated.
    probe, tip
        Names; that of the tip is empty where no record names it.
    part_c, probe_c
        Temperatures, °C; None where nobody gave them.
    verdict
        On the part, one of `PART_VERDICTS`.
    complete, simulated
        Everything was measured; it came from a virtual rig.
    points
        That count.
    seal, signer
        What is said of the signature of its head, and fingerprint of the key.
    fault
        Why nothing of it counts; empty where nothing speaks against the file.
    """

    job_uuid: str
    steps: int
    head: str
    sha256: str
    size: int
    station: str
    state: JobState
    part: str
    serial: str
    order_name: str
    batch: str
    operator: str
    plan: str
    plan_sha256: str
    program: str
    created_utc: str
    changed_utc: str
    rig: str
    calibration: str
    probe: str
    tip: str
    part_c: float | None
    probe_c: float | None
    verdict: str
    complete: bool
    simulated: bool
    points: int
    seal: str
    signer: str
    fault: str


class JobRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything that the archive keeps of a job beside its file."""

    job: JobRow
    results: tuple[ResultRow, ...]
    uses: tuple[UseRow, ...]


class Sender(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who hands over.

    Attributes
    ----------
    outbox
        Identity of the outbox.
    station
        Name of the station.
    machine
        Identity of the computer, so that two of one name are told apart; empty where jobs are
        taken from their files.
    host, user
        Names, for people.
    """

    outbox: str
    station: str
    machine: str
    host: str
    user: str


class Delivery(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One thing that is handed over.

    Attributes
    ----------
    sender
        By whom.
    sequence
        Number in that outbox, from 1; never used twice.
    sent_utc
        By the clock of the sender.
    record, content
        The rows, and the bytes of the job file.
    """

    sender: Sender
    sequence: int
    sent_utc: str
    record: JobRecord
    content: bytes


class MarkRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that became known of an archived job; the latest of a kind holds.

    Attributes
    ----------
    job_uuid
        Of which job.
    kind
        ``altered``, ``recall`` or ``quality``.
    holds
        The job counts in no statistic, and stations hold it back.
    why, who
        A sentence, and a name.
    utc
        When, ISO 8601 text.
    finding
        Number of the document that it rests on; 0 for none.
    """

    job_uuid: str
    kind: str
    holds: bool
    why: str
    who: str
    utc: str
    finding: int = 0
