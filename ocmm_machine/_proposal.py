"""Corrections from finished jobs: changes of offsets, and their effect.

The deviations are linear in the offsets: d_after = d + S * change. The change is the least-squares
solution with weights by 1 / U². Contributions to U that the characteristics share are unknown here,
so U of a change is the sum of the moduli of all contributions.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec
import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_machine._document import CorrectionDocument
from ocmm_machine._facts import PartFacts
from ocmm_machine._history import CorrectionLine, count_since, values_in_force
from ocmm_machine._sensitivity import SensitivityRow, row_of

_SMALLEST = 1e-9
_RANK = 1e-6


class OffsetChange(msgspec.Struct, frozen=True, kw_only=True):
    """What happens to one offset; mm or degrees."""

    offset: str
    unit: str
    before: float
    found: float
    """The whole change that the deviations ask for, without share and limits."""
    expanded: float
    """U (95 %) of ``found``."""
    needed: float
    """The larger of U and the dead band: ``found`` has to be beyond it."""
    change: float
    after: float
    why: str
    """Why it does not change, or not by its share; may be empty."""


class Effect(msgspec.Struct, frozen=True, kw_only=True):
    """What happens to one characteristic; mm or degrees."""

    characteristic: str
    unit: str
    verdict: str
    deviation: float | None
    expanded: float | None
    """`deviation`, `expanded`: by the method of the document; None without a value."""
    lower: float
    upper: float
    predicted: float | None
    """None if the effect is unknown."""
    why: str


class Proposal(msgspec.Struct, frozen=True, kw_only=True):
    """Corrections to be confirmed, or the reasons why there are none."""

    machine: str
    job: str
    job_uuid: str
    serial: str
    jobs: tuple[str, ...]
    serials: tuple[str, ...]
    """`jobs`, `serials`: of all parts used, the last one last."""
    practice: bool
    refusals: tuple[str, ...]
    """Why nothing may change, in sentences."""
    left_out: tuple[str, ...]
    """Parts and characteristics that do not count, in sentences."""
    changes: tuple[OffsetChange, ...]
    effects: tuple[Effect, ...]
    """`changes`, `effects`: of all offsets and characteristics; empty if refused."""

    @property
    def changed(self) -> tuple[OffsetChange, ...]:
        """Return the offsets that change; empty if anything refuses the correction."""
        return tuple(one for one in self.changes if one.change)

    @property
    def code(self) -> str:
        """Return the code by which a person confirms exactly this proposal."""
        return hashlib.sha256(msgspec.json.encode(self)).hexdigest()[:8]


def propose(
    document: CorrectionDocument,
    parts: Sequence[PartFacts],
    lines: Sequence[CorrectionLine],
    *,
    practice: bool = False,
    recut: bool = False,
    unread: Iterable[str] = (),
) -> Proposal:
    """Return the corrections from the last part, and from earlier ones by the document.

    Parameters
    ----------
    parts
        Oldest first; the last one is the job to correct from.
    lines
        The register of the machine.
    practice
        Simulated jobs count; the result must never reach a machine.
    recut
        The part was cut after the last change, although its serial number occurs there.
    unread
        Sentences on parts that could not be read.
    """
    last = parts[-1]
    refusals = [*_faults(document, last, practice=practice), *_repeats(last, lines, recut=recut)]
    left_out = [*unread]
    used = []
    for one in count_since(document, parts, lines):
        why = "" if one is last else next(iter(_faults(document, one, practice=practice)), "")
        if why:
            left_out.append(f"{one.job} is left out. {why}")
        else:
            used.append(one)
    if not used or used[-1] is not last:
        refusals.append("The part was cut before the control had the last correction.")
    used = used[-document.parts :]
    if len(used) < document.parts:
        refusals.append(
            f"{len(used)} of {document.parts} parts count since the last change of an offset."
        )
    values = values_in_force(document, lines)
    rows = {one.characteristic: row_of(document, one, used or [last], values)
            for one in document.drive}  # fmt: skip
    left_out += [f"{name} does not count. {row.why}" for name, row in rows.items() if row.why]
    changes, notes = _solved(document, [row for row in rows.values() if row.counts], values)
    made = np.array([one.change for one in changes])
    effects = [_effect(one.result, rows.get(name), made) for name, one in last.values.items()]
    refusals += (*notes, *(_harms([*rows.values()], effects, made) if made.any() else ()))
    if refusals:
        # Numbers of a refused correction would be taken for good ones.
        changes, effects = [], []
    return Proposal(
        machine=document.machine, job=last.job, job_uuid=last.uuid, serial=last.serial,
        jobs=tuple(one.uuid for one in used), serials=tuple(one.serial for one in used),
        practice=practice, refusals=tuple(refusals), left_out=tuple(left_out),
        changes=tuple(changes), effects=tuple(effects),
    )  # fmt: skip


def _faults(document: CorrectionDocument, part: PartFacts, *, practice: bool) -> list[str]:
    """Return why a job proves nothing for this document, in sentences."""
    faults = [*part.faults]
    if part.simulated and not practice:
        faults.append("The job is SIMULATED: no real part was measured.")
    if part.plan != document.plan:
        faults.append(f"The job was measured by the plan '{part.plan}', not '{document.plan}'.")
    return faults


def _repeats(last: PartFacts, lines: Sequence[CorrectionLine], *, recut: bool) -> Iterator[str]:
    """Yield why an error may have been corrected already."""
    undone = {one.undoes for one in lines}
    valid = [one for number, one in enumerate(lines, 1) if number not in undone]
    if any(last.uuid in one.jobs for one in valid):
        yield f"The job {last.job} has corrected this machine already."
    known = {serial for one in valid for serial in one.serials}
    numbered = any(letter.isalnum() for letter in last.serial)
    if known and not recut and (not numbered or last.serial in known):
        yield (
            "The part may be the one of an earlier correction, which would count twice. "
            "Confirm with --recut that it was cut after the last change."
        )


def _solved(
    document: CorrectionDocument, rows: Sequence[SensitivityRow], values: Mapping[str, float]
) -> tuple[list[OffsetChange], list[str]]:
    """Return a change for every offset, and refusals that hold for all."""
    slopes = np.array([row.slopes for row in rows]).reshape(-1, len(document.offset))
    deviations = np.array([row.deviation for row in rows])
    expanded = np.array([row.expanded for row in rows])
    roots = np.array([math.sqrt(row.weight) / row.expanded for row in rows])
    needed = np.array([one.dead_band for one in document.offset])
    found, bound, refusals = np.zeros_like(needed), np.zeros_like(needed), list[str]()
    acts = np.flatnonzero(slopes.any(axis=0)).tolist()
    left = list(acts)
    while left:
        norms = np.linalg.norm(roots[:, None] * slopes[:, left], axis=0)
        scaled = roots[:, None] * slopes[:, left] / norms
        if np.linalg.matrix_rank(scaled, tol=_RANK) < len(left):
            names = ", ".join(document.offset[k].name for k in left)
            refusals.append(f"The measured characteristics cannot separate the effects of {names}.")
            break
        gain = np.linalg.pinv(scaled) / norms[:, None] * roots
        found[left], bound[left] = -gain @ deviations, np.abs(gain) @ expanded
        needed[left] = np.maximum(needed[left], bound[left])
        ratios = np.abs(found[left]) / needed[left]
        if ratios.min() > 1.0:
            break
        # The others take over its part: solve again without the least proven one.
        left.pop(int(ratios.argmin()))
    changes = []
    for k, one in enumerate(document.offset):
        wanted = one.share * float(found[k]) if k in left else 0.0
        steps = min(abs(wanted), one.step) / document.resolution + _SMALLEST
        change = round(math.copysign(math.floor(steps) * document.resolution, wanted), 9)
        after = round(values[one.name] + change, 9)
        if k not in left:
            why = "Not beyond U and the dead band." if k in acts else "No value acts on it."
        else:
            why = "Limited to the step." if abs(wanted) > one.step else ""
        if change and not one.lowest <= after <= one.highest:
            refusals.append(f"{one.name} would be {after:g}, beyond its limits: check the machine.")
        changes.append(
            OffsetChange(
                offset=one.name, unit=one.unit, before=values[one.name], found=float(found[k]),
                expanded=float(bound[k]), needed=float(needed[k]), change=change, after=after,
                why=why,
            )
        )  # fmt: skip
    return changes, refusals


def _effect(result: CharacteristicResult, row: SensitivityRow | None, made: Float) -> Effect:
    deviation, expanded, predicted = result.deviation, result.uncertainty, None
    why = "Not in the document: the effect is not known." if row is None else row.why
    if row is not None and not why:
        deviation, expanded, predicted = row.deviation, row.expanded, row.after(made)
    return Effect(
        characteristic=result.name, unit=result.unit, verdict=result.verdict.value,
        deviation=deviation, expanded=expanded, lower=result.lower, upper=result.upper,
        predicted=predicted, why=why,
    )  # fmt: skip


def _harms(rows: Sequence[SensitivityRow], effects: Sequence[Effect], made: Float) -> Iterator[str]:
    """Yield why the changes must not be made although every one is proven."""
    for one in effects:
        if one.predicted is None or one.deviation is None:
            continue
        if one.lower <= one.deviation <= one.upper and not one.lower <= one.predicted <= one.upper:
            yield f"{one.characteristic} would leave its tolerance."
    before, after = (
        sum(row.weight * (row.after(change) / row.expanded) ** 2 for row in rows if row.counts)
        for change in (np.zeros_like(made), made)
    )
    if not after < before:
        yield "The deviations as a whole would not become smaller: use equal shares."
