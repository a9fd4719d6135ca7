"""Results of a recall in words, for pages, tables and the command line."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.inspection import finished
from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_core.wording import Speech

_ENGLISH = Speech()

COLUMNS = ("Job", "Characteristic", "Before", "After", "Result", "Why")

_MEANS = {
    finished.Outcome.HOLDS: "Same verdict with every calibration its spots allow.",
    finished.Outcome.CHANGES: (
        "Different verdict with the later calibration, the only one its spots fit."
    ),
    finished.Outcome.UNKNOWN: "Measure the part again: the file cannot decide.",
}


def headline(record: finished.RecallRecord, speech: Speech = _ENGLISH) -> str:
    if not record.jobs:
        if record.unread:
            return speech.text(f"{len(record.unread)} NOT JUDGED of {record.looked_at} checked")
        return speech.text(f"NO SUSPECT JOBS ({record.looked_at} checked)")
    words = [f"{record.count(one)} {speech.word(one.value)}" for one in reversed(finished.Outcome)]
    simulated = all(job.simulated for job in record.jobs)
    return "   ".join(([speech.word(SIMULATED)] if simulated else []) + words)


def checked(record: finished.RecallRecord) -> str:
    """Return the number of checked jobs, and their folders."""
    count = record.looked_at
    return f"{count:d} job{'' if count == 1 else 's'} checked in {', '.join(record.folders)}."


def totals(record: finished.RecallRecord) -> tuple[str, ...]:
    """Return the counts of jobs and verdicts by outcome, with its meaning, a sentence each."""
    lines = []
    for one in reversed(finished.Outcome):
        jobs, verdicts = record.count(one), record.count_verdicts(one)
        counted = (
            f"{jobs:d} job{'' if jobs == 1 else 's'}, "
            f"{verdicts:d} verdict{'' if verdicts == 1 else 's'}."
        )
        lines.append(f"{one.value}: {counted} {_MEANS[one]}")
    return tuple(lines)


def not_judged(record: finished.RecallRecord, most: int | None = None) -> tuple[str, ...]:
    """Return a sentence for each job that was not judged, at most ``most``."""
    shown = [f"Not judged: {sentence}" for sentence in record.unread[:most]]
    left = len(record.unread) - len(shown)
    return (*shown, f"Not judged: {left} more; all are in the PDF.") if left else (*shown,)


def decided(record: finished.RecallRecord) -> str:
    if not record.made_by:
        return "Not decided: no points released by this recall."
    released = sum(bool(job.released) for job in record.jobs)
    return (
        f"Decided by {record.made_by}, {record.made_utc[:16].replace('T', ' ')} UTC: points of "
        f"{released:d} job{'' if released == 1 else 's'} released, all others stay held back."
    )


def job_line(job: finished.RecalledJob, speech: Speech = _ENGLISH) -> str:
    origin = f"{speech.word(SIMULATED)}, " if job.simulated else ""
    about = f"{job.label}, part {job.part}"
    if job.serial not in ("", "-"):
        about = f"{job.label}, part {job.part}, serial {job.serial}"
    result = f"{speech.word(job.outcome.value)}. {speech.text(job.judgement)}"
    return f"{origin}{speech.text(about)}: {result}"


def rests_on(job: finished.RecalledJob) -> str:
    """Return the evidence for the judgement of a job, with hashes."""
    later = f", recalculated with {job.later[:12]}" if job.later else ""
    return (
        f"{len(job.in_doubt)} suspect points: {' '.join(job.why)} Rig {job.rig}, calibration "
        f"{job.calibration[:12]}{later}. File SHA-256 {job.sha256[:16]}."
    )


def row(
    one: finished.RecalledCharacteristic, speech: Speech = _ENGLISH
) -> tuple[str, str, str, str, str]:
    """Return the cells of a characteristic, after that of its job."""
    after = "–" if one.after is None else _value(one.after, speech)
    outcome = speech.word(one.outcome.value)
    return one.name, _value(one.before, speech), after, outcome, speech.text(one.reason)


def worst_first(jobs: Sequence[finished.RecalledJob]) -> list[finished.RecalledJob]:
    order = {finished.Outcome.CHANGES: 0, finished.Outcome.UNKNOWN: 1, finished.Outcome.HOLDS: 2}
    return sorted(jobs, key=lambda job: (order[job.outcome], job.created_utc))


def _value(found: finished.RecalledValue, speech: Speech) -> str:
    if found.value is None:
        return speech.word(found.verdict)
    spread = "" if found.expanded is None else f" ± {found.expanded:.4f}"
    return f"{speech.number(f'{found.value:.4f}{spread}')} {speech.word(found.verdict)}"
