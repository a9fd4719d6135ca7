"""Results of a recall in words, for pages, tables and the command line."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.inspection.archive import (
    Outcome,
    RecalledCharacteristic,
    RecalledJob,
    RecalledValue,
    RecallRecord,
)
from ocmm_core.inspection.evaluation import SIMULATED

COLUMNS = ("Job", "Characteristic", "Before", "After", "Result", "Why")

_MEANS = {
    Outcome.HOLDS: "Same verdict with every calibration its spots allow.",
    Outcome.CHANGES: "Different verdict with the later calibration, the only one its spots fit.",
    Outcome.UNKNOWN: "Measure the part again: the file cannot decide.",
}


def headline(record: RecallRecord) -> str:
    if not record.jobs:
        if record.unread:
            return f"{len(record.unread)} NOT JUDGED of {record.looked_at} checked"
        return f"NO SUSPECT JOBS ({record.looked_at} checked)"
    words = "   ".join(f"{record.count(one)} {one.value}" for one in reversed(Outcome))
    return f"{SIMULATED}   {words}" if all(job.simulated for job in record.jobs) else words


def checked(record: RecallRecord) -> str:
    """Return the number of checked jobs, and their folders."""
    return f"{_counted(record.looked_at, 'job')} checked in {', '.join(record.folders)}."


def totals(record: RecallRecord) -> tuple[str, ...]:
    """Return the counts of jobs and verdicts by outcome, with its meaning, a sentence each."""
    return tuple(
        f"{one.value}: {_counted(record.count(one), 'job')}, "
        f"{_counted(record.count_verdicts(one), 'verdict')}. {_MEANS[one]}"
        for one in reversed(Outcome)
    )


def not_judged(record: RecallRecord, most: int | None = None) -> tuple[str, ...]:
    """Return a sentence for each job that was not judged, at most ``most``."""
    shown = [f"Not judged: {sentence}" for sentence in record.unread[:most]]
    left = len(record.unread) - len(shown)
    return (*shown, f"Not judged: {left} more; all are in the PDF.") if left else (*shown,)


def decided(record: RecallRecord) -> str:
    if not record.made_by:
        return "Not decided: no points released by this recall."
    released = sum(bool(job.released) for job in record.jobs)
    return (
        f"Decided by {record.made_by}, {record.made_utc[:16].replace('T', ' ')} UTC: points of "
        f"{_counted(released, 'job')} released, all others stay held back."
    )


def job_line(job: RecalledJob) -> str:
    serial = f", serial {job.serial}" if job.serial not in ("", "-") else ""
    origin = f"{SIMULATED}, " if job.simulated else ""
    about = f"{origin}{job.label}, part {job.part}{serial}"
    return f"{about}: {job.outcome.value}. {job.judgement}"


def rests_on(job: RecalledJob) -> str:
    """Return the evidence for the judgement of a job, with hashes."""
    later = f", recalculated with {job.later[:12]}" if job.later else ""
    return (
        f"{len(job.in_doubt)} suspect points: {' '.join(job.why)} Rig {job.rig}, calibration "
        f"{job.calibration[:12]}{later}. File SHA-256 {job.sha256[:16]}."
    )


def row(one: RecalledCharacteristic) -> tuple[str, str, str, str, str]:
    """Return the cells of a characteristic, after that of its job."""
    after = "–" if one.after is None else _value(one.after)
    return one.name, _value(one.before), after, one.outcome.value, one.reason


def worst_first(jobs: Sequence[RecalledJob]) -> list[RecalledJob]:
    order = {Outcome.CHANGES: 0, Outcome.UNKNOWN: 1, Outcome.HOLDS: 2}
    return sorted(jobs, key=lambda job: (order[job.outcome], job.created_utc))


def _value(found: RecalledValue) -> str:
    if found.value is None:
        return found.verdict
    spread = "" if found.expanded is None else f" ± {found.expanded:.4f}"
    return f"{found.value:.4f}{spread} {found.verdict}"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
