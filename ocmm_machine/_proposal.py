"""Corrections from finished jobs: changes of offsets, and their effect.

The deviations are linear in the offsets: d_after = d + S * change. The change is the least-squares
solution with weights by 1 / U². Contributions to U that the characteristics share are unknown here,
so U of a change is the sum of the moduli of all contributions.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from scipy import stats

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_machine._document import (
    ControlOffset,
    CorrectionDocument,
    CorrectionLine,
    Drive,
    MeasuredValue,
    PartFacts,
    count_since,
    values_in_force,
    vector_of,
)

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


_SIZES = {"diameter": 1.0, "width": 1.0, "radius": 0.5}
"""Kinds of sizes, as parts of a diameter."""


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """One characteristic: deviation, U, and its sensitivity to every offset."""

    deviation: float
    expanded: float
    slopes: tuple[float, ...]
    weight: float
    why: str
    """Why it does not count; the numbers are then not used."""

    @property
    def counts(self) -> bool:
        return not self.why and self.weight > 0.0

    def after(self, changes: Float) -> float:
        """Return the deviation after changes of all offsets."""
        return self.deviation + float(np.array(self.slopes) @ changes)


def row_of(
    document: CorrectionDocument,
    drive: Drive,
    parts: Sequence[PartFacts],
    values: Mapping[str, float],
) -> SensitivityRow:
    """Return the row of a drive from its parts; it does not count unless proven in all of them."""
    found = [part.values.get(drive.characteristic) for part in parts]
    why = next(filter(None, map(_refusal, parts, found)), "")
    last, stated = found[-1], [one.result.stated for one in found if one is not None]
    if why or last is None or None in stated:
        return SensitivityRow(0.0, 1.0, (0.0,) * len(document.offset), 0.0, why)
    numbers = np.array(stated, dtype=np.float64)
    level, expanded = _level(document.method, numbers[:, 1], float(numbers[:, 2].max()))
    slopes = tuple(
        _slope(document, drive, one, last, parts[-1], values) if one.name in drive.offsets else 0.0
        for one in document.offset
    )
    return SensitivityRow(level, expanded, slopes, drive.weight, "")


def _refusal(part: PartFacts, measured: MeasuredValue | None) -> str:
    """Return why a value does not count, as a sentence; empty if it does."""
    if measured is None:
        return f"{part.job} has no such characteristic."
    if measured.result.kind == "coordinate" and not part.aligned:
        return f"{part.job} has no part frame."
    return measured.refusal


def _level(method: str, deviations: Float, expanded: float) -> tuple[float, float]:
    """Return the deviation to be corrected and its U, with the scatter from part to part."""
    count = len(deviations)
    if method == "last" or count < 2:
        return float(deviations[-1]), expanded
    at = np.arange(count) - (count - 1) / 2.0
    if method == "mean" or count < 3:
        level, freedom, lever = float(deviations.mean()), count - 1, 1.0 / count
        residuals = deviations - level
    else:
        slope = float(at @ deviations / (at @ at))
        level = float(deviations.mean()) + slope * (at[-1] + 1.0)
        residuals = deviations - deviations.mean() - slope * at
        freedom, lever = count - 2, 1.0 / count + (at[-1] + 1.0) ** 2 / (at @ at)
    scatter = math.sqrt(residuals @ residuals / freedom * lever)
    return level, math.hypot(expanded, float(stats.t.ppf(0.975, freedom)) * scatter)


def _slope(
    document: CorrectionDocument,
    drive: Drive,
    offset: ControlOffset,
    measured: MeasuredValue,
    part: PartFacts,
    values: Mapping[str, float],
) -> float:
    """Return the growth of a deviation with an offset; InputError if it cannot be meant."""
    kind, axis = measured.result.kind, measured.axis
    if drive.acts in ("outer", "inner"):
        if kind not in _SIZES:
            raise _contradiction(drive, "acts", f"it is a {kind}, not a size")
        grown = _SIZES[kind] * (2.0 if offset.counts == "radius" else 1.0)
        # A larger radius keeps the cutter away from the material: shafts grow, bores shrink. The X
        # of a turning tool moves away from the axis: both grow.
        return -grown if offset.kind == "radius" and drive.acts == "inner" else grown
    assert drive.direction  # noqa: S101 - checked with the document
    R_machine_from_part = document.frame.R_machine_from_part
    along = R_machine_from_part @ vector_of(drive.direction)
    if kind not in ("coordinate", "distance"):
        raise _contradiction(drive, "acts", f"it is a {kind}, not a place or distance")
    if kind == "coordinate" and drive.direction != f"+{axis.upper()}":
        raise _contradiction(drive, "direction", f"the coordinate counts along +{axis.upper()}")
    if kind == "distance" and axis and drive.direction[1] != axis.upper():
        raise _contradiction(drive, "direction", f"the distance is along {axis.upper()}")
    if offset.kind != "work":
        return float(along[2])
    if offset.axis == "c":
        feature = drive.feature or measured.result.features[0]
        place = part.places.get(feature)
        if place is None:
            raise _contradiction(drive, "feature", f"'{feature}' has no nominal place")
        x, y, _ = R_machine_from_part @ (place - np.array(document.frame.origin))
        return math.radians(1.0) * float(along @ (-y, x, 0.0))
    # In the document at most once; a rotation that is not in it is zero.
    turn = sum(
        math.radians(values[one.name])
        for one in document.offset
        if one.axis == "c" and one.number == offset.number
    )
    c, s = math.cos(turn), math.sin(turn)
    x, y, z = along
    return float({"x": c * x - s * y, "y": s * x + c * y, "z": z}[offset.axis])


def _contradiction(drive: Drive, field: str, why: str) -> InputError:
    return InputError(
        "correction.drive",
        f"Field '{field}' of drive '{drive.characteristic}' contradicts the plan: {why}.",
        "Correct the document of corrections.",
    )
