"""State of the cameras during a job, and its consequence for the verdicts.

Between the last good check and the failed one the cameras changed once, at an unknown time: before,
after, or during a job. The spots exclude a case that they fit clearly worse than noise allows, or
clearly worse than another case. A verdict holds only if it is the same in every remaining case. The
place of the change is estimated from all jobs together: jobs before and after narrow it down.

An artefact found wrong invalidates everything based on it: every later calibration and verification
with a bar or sphere gets an entry in the history of its rig, from which its state, points and jobs
follow (`calibration.history.judgements`, `inspection.camera_doubts`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

from ocmm_core.calibration.records import CalibrationStore, EventKind, record_hash, rests_on
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.finished import Outcome, RecalledCharacteristic, RecalledValue
from ocmm_core.inspection.recall._recall_job import Anew, JobFindings
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict

WORSE = 40.0
"""A case is excluded by another one whose chi-square is smaller by this, after correction for
correlation: a likelihood ratio of exp(20). Noise alone does so in less than one of 10^9 jobs (6.3
sigma)."""

SURPRISE = 6.0
"""A case is excluded if its chi-square exceeds its degrees of freedom by this many sigma."""

_SAME_VERDICT = {
    (True, True): "Same verdict with the calibration before and after the change.",
    (True, False): "Same verdict with the calibration before the change.",
    (False, True): "Same verdict with the calibration after the change.",
}
"""By: measured before the change, and after it; whole sentences, for translation."""


@dataclass(frozen=True, slots=True)
class Cases:
    """Remaining cases of a job of n points."""

    before: bool
    after: bool
    across: tuple[int, ...] = ()
    """It changed before the point at one of these indices, 1 to n - 1."""

    @property
    def none(self) -> bool:
        return not (self.before or self.after or self.across)


def cases_of(jobs: Sequence[tuple[JobFindings, Anew]]) -> list[Cases]:
    """Return the other cases of jobs, in order of start, of a calibration and a later one."""
    courses = [_course(anew) for _, anew in jobs]
    single = [_by_itself(anew, course) for (_, anew), course in zip(jobs, courses, strict=True)]
    apart = all(one.ended_utc < two.begun_utc for (one, _), (two, _) in pairwise(jobs))
    if not apart:
        # The change cannot be located in jobs that were measured alternately.
        return single
    together = _together(courses, single)
    return [
        Cases(one.before, one.after, tuple(sorted(set(one.across) & inside)))
        for one, inside in zip(single, together, strict=True)
    ]


def _course(anew: Anew) -> Float:
    """Return chi-square by index of a change, (n + 1,), corrected for correlation.

    First: job after the change, last: before it.
    """
    return (anew.own_fit.first + anew.later_fit.last) / anew.own_fit.alike


def _by_itself(anew: Anew, course: Float) -> Cases:
    own = anew.own_fit
    dof = float(own.dof[-1])
    surprise = (course * own.alike - dof) / np.sqrt(2.0 * max(dof, 1.0) * own.alike)
    possible = (course <= float(course.min()) + WORSE) & (surprise <= SURPRISE)
    inner = np.flatnonzero(possible[1:-1]) + 1
    return Cases(bool(possible[-1]), bool(possible[0]), tuple(int(place) for place in inner))


def _together(courses: Sequence[Float], single: Sequence[Cases]) -> list[set[int]]:
    """Return the possible indices of the one change inside each job, by all jobs."""
    # A job that fits neither calibration does not locate a change from one to the other.
    weights = [0.0 if one.none else 1.0 for one in single]
    before = np.array([w * course[-1] for w, course in zip(weights, courses, strict=True)])
    after = np.array([w * course[0] for w, course in zip(weights, courses, strict=True)])
    elsewhere = [float(before[:at].sum() + after[at + 1 :].sum()) for at in range(len(courses))]
    least = min(
        total + w * float(course.min())
        for total, w, course in zip(elsewhere, weights, courses, strict=True)
    )
    return [
        {int(place) for place in np.flatnonzero(total + w * course <= least + WORSE)}
        for total, w, course in zip(elsewhere, weights, courses, strict=True)
    ]


def judgement(job: JobFindings, cases: Cases) -> str:
    """Return the conclusion from a job's spots, in a sentence."""
    if cases.none:
        return "The spots fit neither calibration: the cameras were in a third state."
    if cases.across:
        numbers = [job.points[place].number for place in (cases.across[0] - 1, cases.across[-1])]
        return (
            f"The cameras may have changed during this job, between points {numbers[0]} and "
            f"{numbers[1]}."
        )
    if cases.before and cases.after:
        return "The spots fit both calibrations: before or after the change."
    if cases.before:
        return "The spots fit the calibration of the job only: measured before the change."
    return "The spots fit the later calibration only: measured after the change."


def recalled(job: JobFindings, anew: Anew, cases: Cases) -> tuple[RecalledCharacteristic, ...]:
    return tuple(
        _recalled(own, later, rests_on, cases, in_world=in_world)
        for own, later, rests_on, in_world in zip(
            job.own, anew.results, job.rests_on, job.in_world, strict=True
        )
    )


def unknown(job: JobFindings, why: str) -> tuple[RecalledCharacteristic, ...]:
    return tuple(_unknown(own, why) for own in job.own)


def _recalled(
    own: CharacteristicResult,
    later: CharacteristicResult,
    rests_on: Sequence[int],
    cases: Cases,
    *,
    in_world: bool,
) -> RecalledCharacteristic:
    if cases.none:
        return _unknown(own, "The spots fit neither calibration.")
    before, after = cases.before, cases.after
    for place in cases.across:
        if not rests_on or max(rests_on) < place:
            before = True
        elif min(rests_on) >= place:
            after = True
        else:
            return _unknown(own, "The cameras may have changed between its points.")
    if after and in_world:
        return _unknown(own, "Stated in the camera world frame, not the part frame.")
    if after and (later.measured is None) != (own.measured is None):
        return _unknown(own, later.note or "No value with the later calibration.")
    stated = [one for one, possible in ((own, before), (later, after)) if possible]
    after_value = _value(stated[-1])
    verdicts = {one.verdict for one in stated}
    if len(verdicts) > 1:
        return RecalledCharacteristic(
            name=own.name, before=_value(own), after=_value(later), outcome=Outcome.UNKNOWN,
            reason="The spots fit both calibrations, and the verdicts differ.", released=False,
        )  # fmt: skip
    if own.verdict not in verdicts:
        return RecalledCharacteristic(
            name=own.name, before=_value(own), after=after_value, outcome=Outcome.CHANGES,
            reason="The spots fit the later calibration only.", released=False,
        )  # fmt: skip
    off = max((_off(own, one) for one in stated), default=0.0)
    released = off <= 1.0
    reason = _SAME_VERDICT[before, after]
    if not released:
        reason += " The value is off by more than its U: use the recalculated one."
    return RecalledCharacteristic(
        name=own.name, before=_value(own), after=after_value, outcome=Outcome.HOLDS,
        reason=reason, released=released,
    )  # fmt: skip


def _unknown(own: CharacteristicResult, why: str) -> RecalledCharacteristic:
    return RecalledCharacteristic(
        name=own.name, before=_value(own), after=None, outcome=Outcome.UNKNOWN, reason=why,
        released=False,
    )  # fmt: skip


def _value(result: CharacteristicResult) -> RecalledValue:
    return RecalledValue(
        value=result.measured, expanded=result.uncertainty, verdict=result.verdict.value
    )


def _off(own: CharacteristicResult, other: CharacteristicResult) -> float:
    """Return the distance of a value from the stated one, in units of the stated U."""
    if own.measured is None or other.measured is None or not own.uncertainty:
        return 0.0
    if own.verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL):
        return 0.0
    return abs(other.measured - own.measured) / own.uncertainty


@dataclass(frozen=True, slots=True)
class Fallen:
    """An invalidated calibration or verification."""

    rig: str
    made_utc: str
    kind: str
    """``"calibration"`` or ``"verification"``."""
    calibration: str
    """Hash of the calibration that it is, or that it was about."""


def artefact_wrong(
    calibrations: Path, serial: str, since: datetime, who: str, now: datetime
) -> tuple[Fallen, ...]:
    """Invalidate all that is based on an artefact since a moment, once; return what was.

    ``calibrations``: one subfolder per rig; ``serial``: as in its document, see
    `serials.same_serial`; ``since``: start of the error. InputError if no record here is based on
    it since then; OcmmError if a history or a record cannot be read, or written.
    """
    folders = [folder for folder in files_of_folder(calibrations, "") if folder.is_dir()]
    stores = [CalibrationStore(one) for one in folders if files_of_folder(one, "events.jsonl")]
    # All are read before the first write.
    found = [(store, *_resting_on(store, serial, since)) for store in stores]
    if not any(records or checks for _, records, checks in found):
        raise InputError(
            "recall.artefact",
            f"No calibration or verification in {calibrations} is based on an artefact with "
            f"serial number {serial!r} since {since.date().isoformat()}.",
            "Check serial number and date; the Calibration page lists the artefacts.",
        )
    fallen: list[Fallen] = []
    reason = f"Artefact {serial} was found to be wrong since {since.date().isoformat()}."
    for store, records, checks in found:
        known = {
            (one.calibration, one.evidence) for one in store.events if one.kind is EventKind.FALLEN
        }
        rig = store.folder.name
        lines = [(digest, "", made, "calibration") for digest, made in records]
        lines += [(about, digest, made, "verification") for about, digest, made in checks]
        for about, evidence, made, kind in lines:
            if (about, evidence) not in known:
                store.fall(about, evidence, who=who, reason=reason, since=since, now=now)
                fallen.append(Fallen(rig, made, kind, about))
    return tuple(fallen)


def _resting_on(
    store: CalibrationStore, serial: str, since: datetime
) -> tuple[list[tuple[str, str]], list[tuple[str, str, str]]]:
    """Return calibrations (hash, made) and verifications (about, hash, made) on an artefact."""
    records = [
        (record_hash(one), one.made_utc)
        for one in store.records()
        if rests_on(one.artefacts, serial) and _time(one.made_utc) >= since
    ]
    checks = [
        (one.calibration, record_hash(one), one.made_utc)
        for one in store.verifications()
        if rests_on(one.artefacts, serial) and _time(one.made_utc) >= since
    ]
    return records, checks


def _time(utc: str) -> datetime:
    found = datetime.fromisoformat(utc)
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)
