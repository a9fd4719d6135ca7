"""Signature of the station on a job: a row next to the audit for every transaction.

The hash of the last audit row covers everything ever stored, so does a signature on it. A job is
continued only if its last signature is valid and trusted, which so vouches for all earlier ones.
The memory of the station (`seals`), or a line on paper, reveals a removed end.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core import seals
from ocmm_core.errors import InputError, StorageError
from ocmm_core.storage._faults import damaged
from ocmm_core.storage._rows import seal_fault

_LINE = "ocmm-job-1"

ADOPTED = "adopted"
"""Event by which a person adopts steps that this station did not sign."""


@dataclass(frozen=True, slots=True)
class JobSeal:
    """End of a job, and the state of its signature."""

    job_uuid: str
    steps: int
    head: str
    """`steps`, `head`: Rows of the audit, and the hash of the last one."""
    state: seals.SealState
    signature: seals.Signature | None = None
    unsigned: int = 0
    """Number of initial rows stored without a signature."""
    missing: str = ""
    """Contradiction with the memory of the station, as a sentence; empty if none."""
    older: bool = False
    """The contradiction is only that later steps, or the memory itself, are missing."""
    forgotten: str = ""
    """Why the memory of the station has nothing of the job, although it should; empty if it has."""
    adopted: tuple[str, ...] = ()
    """Texts of adoptions: person, reason, and everything that was suspect."""

    @property
    def line(self) -> str:
        """Return the proof on paper: the head with the signature; empty without one."""
        if self.signature is None:
            return ""
        return ":".join(
            (_LINE, self.job_uuid, str(self.steps), self.head, self.signature.key,
             self.signature.value)
        )  # fmt: skip

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return why the job is suspect, in sentences."""
        found = {
            seals.SealWord.SEALED: (),
            seals.SealWord.NOT_SIGNED: (
                "The job is not signed: an earlier version made it, or its signatures were "
                "removed. Whether it is as it was made is not known.",
            ),
            seals.SealWord.UNKNOWN_KEY: (
                "The job was signed by a station that this computer does not know "
                f"(key {seals.shown_key(self.state.fingerprint)}).",
            ),
            seals.SealWord.FORGED: ("The signature of the job does not belong to it.",),
        }[self.state.word]
        return (*found, *([self.missing] if self.missing else []))


def insert_seal(db: sqlite3.Connection, key: seals.StationKey) -> tuple[int, str]:
    """Sign the last row of the audit, in the caller's transaction; return number and hash."""
    steps, head = _last(db)
    signature = seals.sign(key, seals.Signed.JOB, _content(steps, head))
    db.execute("INSERT INTO seal VALUES (?, ?, ?)", (steps, signature.key, signature.value))
    return steps, head


def read_seal(
    db: sqlite3.Connection,
    path: Path,
    job_uuid: str,
    keys: seals.KeyFolder,
    end: Callable[[], seals.KnownEnd | None],
) -> JobSeal:
    """Return a job's end and signature state; StorageError: malformed row, or key ring.

    `end`: returns the end in the memory of the station, as `recalled_end`.
    """
    steps, head = _last(db)
    # All rows, also those not evaluated: a row that this program never writes is damage.
    fault = seal_fault(db.execute("SELECT sequence, key, signature FROM seal"), steps)
    if fault:
        raise damaged(path, fault)
    row = db.execute("SELECT key, signature FROM seal WHERE sequence = ?", (steps,)).fetchone()
    signature = None if row is None else seals.Signature(*row)
    state = seals.judge_signature(keys, seals.Signed.JOB, _content(steps, head), signature)
    (first,) = db.execute("SELECT coalesce(min(sequence), 0) FROM seal").fetchone()
    missing, older = _missing(db, job_uuid, steps, state, keys, end)
    is_forgotten = (
        not missing and state.station == seals.THIS_STATION and recalled_end(job_uuid) is None
    )
    forgotten = seals.memory_start(keys) if is_forgotten else ""
    adopted = db.execute("SELECT text FROM event WHERE kind = ? ORDER BY rowid", (ADOPTED,))
    return JobSeal(
        job_uuid, steps, head, state, signature, max(first - 1, 0), missing, older,
        forgotten,
        tuple(str(text) for (text,) in adopted),
    )  # fmt: skip


def judge_head(
    keys: seals.KeyFolder, steps: int, head: str, signature: seals.Signature | None
) -> seals.SealState:
    """Return the signature state of a head without the file; StorageError: unreadable key ring."""
    return seals.judge_signature(keys, seals.Signed.JOB, _content(steps, head), signature)


def check_line(db: sqlite3.Connection, job_uuid: str, line: str, keys: seals.KeyFolder) -> str:
    """Return the proof by a line from paper; StorageError: another job, or contradiction."""
    parts = line.strip().split(":")
    if len(parts) != 6 or parts[0] != _LINE or not parts[2].isdecimal() or len(parts[2]) > 12:
        raise InputError(
            "job.line",
            "This is not the line of a job report.",
            "Scan the code of the report again.",
        )
    _, uuid, steps, head, key, signature = parts
    state = seals.judge_signature(
        keys, seals.Signed.JOB, _content(int(steps), head), seals.Signature(key, signature)
    )
    if not state.sound:
        why = {seals.SealWord.UNKNOWN_KEY: f"signed by {state.signer}"}.get(
            state.word, "not as it was signed"
        )
        raise StorageError(
            "job.line_forged", f"The line on the report is {why}.", "Do not rely on that report."
        )
    if uuid != job_uuid:
        raise StorageError(
            "job.line_other", "The line on the report is about another job.", "Find its job file."
        )
    row = db.execute("SELECT hash FROM audit WHERE sequence = ?", (int(steps),)).fetchone()
    if row is None or row[0] != head:
        raise StorageError(
            "job.line_differs",
            f"The report was made from step {steps} of this job, which the file does not hold"
            f"{'' if row is None else ' as it was then'}.",
            "Restore the file from a backup; what it says now is not what was reported.",
        )
    (last,) = db.execute("SELECT max(sequence) FROM audit").fetchone()
    more = last - int(steps)
    after = f"; {more} step{'s' if more > 1 else ''} came after it" if more else ""
    return f"The report was made from this job at step {steps}{after}. Signed by {state.signer}."


def remember_job(job_uuid: str, steps: int, head: str, place: Path) -> None:
    """Store the end of a job in the memory of the station."""
    seen = seals.KnownEnd(name=_name(job_uuid), count=steps, link=head, place=str(place))
    seals.remember(seen, sync=False)


def expect_job(job_uuid: str, place: Path) -> None:
    """Open the memory of a new job, before it is signed for the first time."""
    seals.expect(_name(job_uuid), place)


def require_adoptable(seal: JobSeal, path: Path, faults: Sequence[str]) -> None:
    """Refuse to adopt a job that needs no adoption, or that is proven to be changed.

    `faults`: of the file against its own chain. Raises StorageError if the job is sealed, was
    changed, was signed by an unknown station, or contradicts the memory of this station by more
    than missing steps at the end.
    """
    word, found = seal.state.word, list(faults)
    if word in (seals.SealWord.UNKNOWN_KEY, seals.SealWord.FORGED) or (
        seal.missing and not seal.older
    ):
        found += seal.doubts
    elif word is seals.SealWord.NOT_SIGNED and seal.missing:
        # Jobs enter the memory when signed, so its signatures were removed since.
        found += ["This station signed this job, and the signatures were removed.", seal.missing]
    if found or not seal.doubts:
        raise StorageError(
            "job.not_adopted",
            f"{path}: {' '.join(found) or 'the job is sealed already.'}",
            "It cannot be taken over: restore a good copy." if found else "Nothing is needed.",
        )


def require_sealed(seal: JobSeal, path: Path) -> None:
    """Raise StorageError for a job with an unknown signer, no signature, or missing steps."""
    if not seal.doubts:
        return
    adopt = not seal.missing or seal.older
    adopt = adopt and (seal.state.sound or seal.state.word is seals.SealWord.NOT_SIGNED)
    raise StorageError(
        "job.not_sealed",
        f"{path}: nothing can be added to this job. {seal.doubts[0]}",
        (
            "Restore the newest copy of it. If this is the newest one, whoever answers for it can "
            "take it over: ocmm audit adopt."
            if adopt
            else "It can be opened to look at. Start a new job to measure."
        ),
    )


def _missing(
    db: sqlite3.Connection,
    job_uuid: str,
    steps: int,
    state: seals.SealState,
    keys: seals.KeyFolder,
    end: Callable[[], seals.KnownEnd | None],
) -> tuple[str, bool]:
    """Return how a job contradicts the memory, and whether only its end or the memory is lost."""
    try:
        seen = end()
    except StorageError as error:
        return f"{error.what} {error.remedy}", True
    if seen is None:
        last = db.execute("SELECT max(time_utc) FROM audit").fetchone()[0]
        own = state.station == seals.THIS_STATION and last
        lost = seals.memory_loss(_name(job_uuid), last, keys) if own else None
        return ("", False) if lost is None else (f"{lost.what} {lost.remedy}", True)
    if seen.count > steps:
        return (
            f"{seen.count - steps} of {seen.count} steps that this computer has seen are missing "
            "at the end: it is an older copy of the job, or its end was removed.",
            True,
        )
    row = db.execute("SELECT hash FROM audit WHERE sequence = ?", (seen.count,)).fetchone()
    if not seen.count or (row is not None and row[0] == seen.link):
        return "", False
    return (
        f"Step {seen.count} is not the one that this computer has seen: the job was replaced.",
        False,
    )


def recalled_end(job_uuid: str) -> seals.KnownEnd | None:
    """Return the end of a job in the memory of the station; StorageError if it is damaged."""
    return seals.recall(_name(job_uuid))


def _last(db: sqlite3.Connection) -> tuple[int, str]:
    row = db.execute("SELECT sequence, hash FROM audit ORDER BY sequence DESC LIMIT 1").fetchone()
    return (0, "") if row is None else (int(row[0]), str(row[1]))


def _content(steps: int, head: str) -> bytes:
    return b"%d %s" % (steps, head.encode())


def _name(job_uuid: str) -> str:
    return f"job {job_uuid}"
