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

SIGNED, NOT_SIGNED, FORGED = SEALS = ("SIGNED", "NOT SIGNED", "FORGED")
"""A signature that verifies by its own key, none, and one that does not belong to the content."""

LONGEST_NAME = 300
LONGEST_SENTENCE = 3000
MOST_RESULTS = 20_000
LARGEST_CONTENT = 256 << 20
"""Bytes of a job file that is archived; one of 100,000 points has less."""


class ResultRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One characteristic of one job."""

    position: int
    """In the plan, from 0."""
    characteristic: str
    kind: str
    """`characteristic`, `kind`: As in the plan."""
    unit: str
    """Of all numbers here: mm or deg."""
    nominal: float
    low: float | None
    high: float | None
    """`nominal`, `low`, `high`: Limits of the value; None where there is none."""
    value: float | None
    uncertainty: float | None
    """`value`, `uncertainty`: As they may be reported, U (95 %); None where there is no trustworthy
    value."""
    verdict: str
    """One of `VERDICTS`."""
    why_not: str
    """Why the value counts in no statistic; empty where it does."""


class UseRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that a job was measured with."""

    kind: UseKind
    """What it is."""
    identity: str
    """SHA-256 of its record or document; the serial number of an artefact."""
    name: str
    """What people call it."""


class JobRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One job as it stood when it was handed over."""

    job_uuid: str
    steps: int
    head: str
    """`job_uuid`, `steps`, `head`: Which job, how many rows its audit has, and the hash of the last
    one."""
    sha256: str
    size: int
    """`sha256`, `size`: Of the file."""
    station: str
    """Where it was measured."""
    state: JobState
    """Finished, paused, or left open."""
    part: str
    serial: str
    order_name: str
    batch: str
    operator: str
    """`part`, `serial`, `order_name`, `batch`, `operator`: As entered."""
    plan: str
    plan_sha256: str
    """`plan`, `plan_sha256`: Name of the plan, and hash of its document."""
    program: str
    """Version that made the file."""
    created_utc: str
    changed_utc: str
    """`created_utc`, `changed_utc`: Begun, and what happened last, ISO 8601 text in UTC."""
    rig: str
    calibration: str
    """`rig`, `calibration`: Name of the rig, and hash of its record; the latter is empty where it
    was not calibrated."""
    probe: str
    tip: str
    """`probe`, `tip`: Names; that of the tip is empty where no record names it."""
    part_c: float | None
    probe_c: float | None
    """`part_c`, `probe_c`: Temperatures, °C; None where nobody gave them."""
    verdict: str
    """On the part, one of `PART_VERDICTS`."""
    complete: bool
    simulated: bool
    """`complete`, `simulated`: Everything was measured; it came from a virtual rig."""
    points: int
    """That count."""
    seal: str
    """One of `SEALS`, whoever signed: readers decide which keys they trust."""
    signer: str
    """Fingerprint of the key that signed its head."""
    fault: str
    """Why nothing of it counts; empty if the file is sound."""
    key: str = ""
    signature: str = ""
    """`key`, `signature`: Public key and signature of the head, Base64; empty if not signed."""
    requirements: str = ""
    """How many requirements of its sources the plan contains; empty without a source."""


class JobRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything that the archive keeps of a job beside its file."""

    job: JobRow
    results: tuple[ResultRow, ...]
    uses: tuple[UseRow, ...]


class Sender(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who hands over."""

    outbox: str
    """Identity of the outbox."""
    station: str
    """Name of the station."""
    machine: str
    """Identity of the computer, so that two of one name are told apart; empty where jobs are taken
    from their files."""
    host: str
    user: str
    """`host`, `user`: Names, for people."""
    key: str = ""
    proof: str = ""
    """`key`, `proof`: Public key of the station, and its signature of `station_claim`, Base64;
    empty if it has no key."""


class Delivery(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One thing that is handed over."""

    sender: Sender
    """By whom."""
    sequence: int
    """Number in that outbox, from 1; never used twice."""
    sent_utc: str
    """By the clock of the sender."""
    record: JobRecord
    content: bytes
    """`record`, `content`: The rows, and the bytes of the job file."""
    signature: str = ""
    """Of `delivery_claim` by the key of the sender, Base64; empty if it has no key."""


def station_claim(station: str) -> bytes:
    """Return what a station signs to prove that a key is its own."""
    return station.encode()


def delivery_claim(outbox: str, sequence: int, sha256: str) -> bytes:
    """Return what a station signs with each delivery: its number is bound to its key."""
    return f"{outbox} {sequence} {sha256}".encode()


class MarkRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that became known of an archived job; the latest of a kind holds."""

    job_uuid: str
    kind: str
    """``altered``, ``recall`` or ``quality``."""
    holds: bool
    """The job counts in no statistic, and stations hold it back."""
    why: str
    who: str
    """`why`, `who`: A sentence, and a name."""
    utc: str
    """When, ISO 8601 text."""
    finding: int = 0
    """Number of the document that it rests on; 0 for none."""
