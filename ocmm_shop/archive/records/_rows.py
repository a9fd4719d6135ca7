"""Rows of a job, as delivered and stored."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.tolerances.decisions import PartWord, Verdict


def shown_text(text: str, instead: str = "\N{REPLACEMENT CHARACTER}") -> str:
    """Replace control, format and surrogate characters in a text, and limit its length."""
    kept = text[:LONGEST_SENTENCE]
    if kept.isprintable():
        return kept
    return "".join(c if c.isprintable() else instead for c in kept)


JobState = Literal["finished", "paused", "open"]
STATES: tuple[JobState, ...] = ("finished", "paused", "open")
UseKind = Literal["calibration", "tip", "probe", "artefact", "rig", "plan", "reference"]
USES: tuple[UseKind, ...] = (
    "calibration", "tip", "probe", "artefact", "rig", "plan", "reference",
)  # fmt: skip
VERDICTS = tuple(one.value for one in Verdict)
PART_VERDICTS = tuple(one.value for one in PartWord)

SIGNED, NOT_SIGNED, FORGED = SEALS = ("SIGNED", "NOT SIGNED", "FORGED")
"""A signature valid for its own key, none, and one that does not match the content."""

LONGEST_NAME = 300
LONGEST_SENTENCE = 3000
MOST_RESULTS = 20_000
LARGEST_CONTENT = 256 << 20
"""Bytes of a job file; one of 100,000 points has less."""


class ResultRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One characteristic of one job."""

    position: int
    """In the plan, from 0."""
    characteristic: str
    kind: str
    unit: str
    """Of all numbers here: mm or deg."""
    nominal: float
    low: float | None
    high: float | None
    """`nominal`, `low`, `high`: Limits of the value; None if one-sided."""
    value: float | None
    uncertainty: float | None
    """`value`, `uncertainty`: As reported, U (95 %); None without a trustworthy value."""
    verdict: str
    """One of `VERDICTS`."""
    why_not: str
    """Why the value counts in no statistic; empty if it does."""


class UseRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Equipment of a job."""

    kind: UseKind
    identity: str
    """SHA-256 of its record or document; the serial number of an artefact."""
    name: str


class JobRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A job at its delivery."""

    job_uuid: str
    steps: int
    head: str
    """`job_uuid`, `steps`, `head`: identity, rows of its audit, and hash of the last one."""
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
    """`plan`, `plan_sha256`: Name of the plan, and hash of its document."""
    program: str
    """Version that made the file."""
    created_utc: str
    changed_utc: str
    """`created_utc`, `changed_utc`: Start and last change, ISO 8601 in UTC."""
    rig: str
    calibration: str
    """`rig`, `calibration`: Name of the rig, and hash of its record; empty if not calibrated."""
    probe: str
    tip: str
    """`probe`, `tip`: Names; the tip's is empty without a record."""
    part_c: float | None
    probe_c: float | None
    """`part_c`, `probe_c`: Temperatures, °C; None if not entered."""
    verdict: str
    """On the part, one of `PART_VERDICTS`."""
    complete: bool
    simulated: bool
    """`complete`, `simulated`: Everything was measured; from a virtual rig."""
    points: int
    """That count."""
    seal: str
    """One of `SEALS`, for any signer: readers decide which keys they trust."""
    signer: str
    """Fingerprint of the key that signed its head."""
    fault: str
    """Why nothing of it counts; empty if the file is sound."""
    key: str = ""
    signature: str = ""
    """`key`, `signature`: Public key and signature of the head, Base64; empty if not signed."""
    requirements: str = ""
    """Requirements of its sources in the plan; empty without a source."""


class JobRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    job: JobRow
    results: tuple[ResultRow, ...]
    uses: tuple[UseRow, ...]


class Sender(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    outbox: str
    station: str
    machine: str
    """Identity of the computer, for equal names; empty for jobs taken from their files."""
    host: str
    user: str
    """`host`, `user`: Names, for people."""
    key: str = ""
    proof: str = ""
    """`key`, `proof`: public key, signature of `station_claim`, Base64; empty without a key."""


class Delivery(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    sender: Sender
    sequence: int
    """Number in that outbox, from 1; never reused."""
    sent_utc: str
    """By the clock of the sender."""
    record: JobRecord
    content: bytes
    signature: str = ""
    """Of `delivery_claim` by the key of the sender, Base64; empty without a key."""


def station_claim(station: str) -> bytes:
    """Return the text that a station signs to prove possession of a key."""
    return station.encode()


def delivery_claim(outbox: str, sequence: int, sha256: str) -> bytes:
    """Return the text that a station signs with each delivery: binds its number to its key."""
    return f"{outbox} {sequence} {sha256}".encode()


class MarkRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A later finding on an archived job; the latest of a kind holds."""

    job_uuid: str
    kind: str
    """``altered``, ``recall`` or ``quality``."""
    holds: bool
    """The job counts in no statistic, and stations hold it."""
    why: str
    who: str
    utc: str
    """ISO 8601."""
    finding: int = 0
    """Number of the underlying document; 0 for none."""
