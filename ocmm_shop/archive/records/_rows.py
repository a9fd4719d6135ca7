"""Rows of a job, as delivered and stored, and their checks.

Both stores check untrusted rows before they store them.
"""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from typing import Literal

import msgspec

from ocmm_core.errors import InputError
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
MOST_WHOLE = 1 << 53
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


_HEX64 = re.compile(r"[0-9a-f]{64}")
_UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


def is_identity(text: object) -> bool:
    """Return whether a text can be the identity of a job."""
    return _has_form(_UUID, text)


def utc_text(text: str) -> str:
    """Return a time in UTC as the archive sorts it; InputError if invalid."""
    try:
        found = datetime.fromisoformat(text)
        if found.tzinfo is None:
            found = found.replace(tzinfo=UTC)
        return found.astimezone(UTC).isoformat(timespec="milliseconds")
    except (ValueError, OverflowError, TypeError):
        raise _bad("time", text, "is no time of ISO 8601") from None


def check_delivery(delivery: Delivery) -> None:
    """Raise InputError if a delivery cannot be stored."""
    check_sender(delivery.sender)
    _whole("sequence", delivery.sequence, 1, MOST_WHOLE)
    utc_text(delivery.sent_utc)
    _name("signature", delivery.signature, empty=True)
    if not isinstance(delivery.content, bytes):
        raise _bad("file", type(delivery.content).__name__, "is no content of a file")
    if len(delivery.content) > LARGEST_CONTENT:
        raise _bad(
            "file", f"{len(delivery.content) >> 20} MB", f"is above {LARGEST_CONTENT >> 20} MB"
        )
    check_record(delivery.record)
    if delivery.record.job.size != len(delivery.content):
        raise _bad("size", delivery.record.job.size, f"is not {len(delivery.content)}")
    if delivery.record.job.station != delivery.sender.station:
        raise _bad("station", delivery.record.job.station, "is not the one that hands over")


def check_sender(sender: Sender) -> None:
    """Raise InputError if the names of a sender cannot be stored."""
    for field in ("station", "machine", "host", "user", "key", "proof"):
        _name(field, getattr(sender, field), empty=field != "station")
    if not _has_form(_UUID, sender.outbox):
        raise _bad("outbox", sender.outbox, "is no identity")


def check_record(record: JobRecord) -> None:
    """Raise InputError if the rows of a job are inconsistent."""
    job = record.job
    if not is_identity(job.job_uuid):
        raise _bad("job", job.job_uuid, "is no identity of a job")
    for field in ("head", "sha256", "plan_sha256"):
        if not _has_form(_HEX64, getattr(job, field)):
            raise _bad(field, getattr(job, field), "is no SHA-256")
    for field in (
        "station", "part", "serial", "order_name", "batch", "operator", "plan", "program", "rig",
        "calibration", "probe", "tip", "signer", "key", "signature", "requirements",
    ):  # fmt: skip
        _name(field, getattr(job, field), empty=True)
    _name("fault", job.fault, LONGEST_SENTENCE, empty=True)
    for field in ("created_utc", "changed_utc"):
        if utc_text(getattr(job, field)) != getattr(job, field):
            raise _bad(field, getattr(job, field), "is not in UTC to the millisecond")
    for field in ("part_c", "probe_c"):
        _number(field, getattr(job, field))
    _whole("steps", job.steps, 1, MOST_WHOLE)
    _whole("points", job.points, 0, MOST_WHOLE)
    _whole("size", job.size, 1, LARGEST_CONTENT)
    _one_of("state", job.state, STATES)
    _one_of("verdict", job.verdict, PART_VERDICTS)
    _one_of("seal", job.seal, SEALS)
    if len(record.results) > MOST_RESULTS or len(record.uses) > MOST_RESULTS:
        raise _bad("results", len(record.results), f"are more than {MOST_RESULTS}")
    for flag in ("complete", "simulated"):
        if not isinstance(getattr(job, flag), bool):
            raise _bad(flag, getattr(job, flag), "is neither true nor false")
    if any(type(row.position) is not int for row in record.results) or [
        row.position for row in record.results
    ] != list(range(len(record.results))):
        raise _bad("results", "their positions", "are not counted from 0")
    for row in record.results:
        _check_result(row)
    seen = set()
    for use in record.uses:
        _one_of("use", use.kind, USES)
        _name("identity", use.identity)
        _name("name", use.name, empty=True)
        if (use.kind, use.identity) in seen:
            raise _bad("use", use.identity, "is there twice")
        seen.add((use.kind, use.identity))


def check_mark(mark: MarkRow) -> None:
    """Raise InputError if a mark cannot be stored."""
    if not is_identity(mark.job_uuid):
        raise _bad("job", mark.job_uuid, "is no identity of a job")
    _one_of("kind", mark.kind, ("altered", "recall", "quality"))
    _name("why", mark.why, LONGEST_SENTENCE)
    _name("who", mark.who)
    utc_text(mark.utc)
    _whole("finding", mark.finding, 0, MOST_WHOLE)


def _has_form(form: re.Pattern[str], value: object) -> bool:
    return isinstance(value, str) and form.fullmatch(value) is not None


def _check_result(row: ResultRow) -> None:
    _name("characteristic", row.characteristic)
    _name("kind", row.kind)
    _one_of("unit", row.unit, ("mm", "deg"))
    _one_of("verdict", row.verdict, VERDICTS)
    _name("why_not", row.why_not, LONGEST_SENTENCE, empty=True)
    for field in ("nominal", "low", "high", "value", "uncertainty"):
        _number(field, getattr(row, field))
    if row.nominal is None:
        raise _bad(row.characteristic, None, "has no nominal value")
    if (row.value is None) != (row.uncertainty is None):
        raise _bad(row.characteristic, row.value, "has a value without U, or U without a value")
    if row.uncertainty is not None and row.uncertainty < 0.0:
        raise _bad(row.characteristic, row.uncertainty, "is a negative U")
    if not row.why_not and row.value is None:
        raise _bad(row.characteristic, row.value, "counts without a value")


def _name(field: str, text: object, longest: int = LONGEST_NAME, *, empty: bool = False) -> None:
    if not isinstance(text, str):
        raise _bad(field, text, "is no text")
    if not text and not empty:
        raise _bad(field, text, "is empty")
    if len(text) > longest:
        raise _bad(field, text[:40], f"has more than {longest} characters")
    # No line breaks, no NUL (PostgreSQL has none), no bidirectional controls.
    if not text.isprintable():
        raise _bad(field, text[:80], "has characters that cannot be shown")


def _number(field: str, value: object) -> None:
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _bad(field, value, "is no finite number")


def _whole(field: str, value: object, least: int, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise _bad(field, value, f"is no whole number from {least} to {most}")


def _one_of(field: str, value: object, known: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in known:
        raise _bad(field, value, f"is none of {', '.join(known)}")


def _bad(field: str, value: object, why: str) -> InputError:
    return InputError(
        "archive.row",
        f"The archive cannot keep this job: {field} {str(value)[:80]!r} {why}.",
        "Keep the job file, and ask whoever looks after the archive.",
    )
