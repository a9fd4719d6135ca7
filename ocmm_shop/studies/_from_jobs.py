"""Studies from recalculated jobs, one per characteristic (`inspection.finished`).

Suspect values count as missing; an unbalanced study is refused, not filled up. Linearity is the
bias of several calibrated parts over the range.

Every measurement of a plan has a code, which is the serial number of its job: operators see neither
part nor trial. The order is random for each operator and trial, against drift and memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.documents import Document, files_of_folder, load_document, write_new
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.geometry import Float
from ocmm_core.inspection.finished import SUFFIX, Comparison, Trend, compare_files
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.names import label_fault
from ocmm_shop.studies import _single as single
from ocmm_shop.studies._gauge_rr import (
    AIAG_LEVEL,
    LEAST_OPERATORS,
    LEAST_PARTS,
    LEAST_TRIALS,
    GaugeStudy,
    gauge_study,
)

STUDY_SCHEMA = "ocmm.msa-plan/1"
_MOST = 10_000


class StudyRun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One measurement: its code and meaning; trials count from 1."""

    code: str
    part: str
    operator: str
    trial: int


class StudyPlan(Document, frozen=True, kw_only=True):
    """A plan, in the order of measurement."""

    name: str
    """Of the study; the batch of its jobs."""
    seed: int
    runs: tuple[StudyRun, ...]

    @property
    def parts(self) -> tuple[str, ...]:
        return tuple(sorted({one.part for one in self.runs}))

    @property
    def operators(self) -> tuple[str, ...]:
        return tuple(sorted({one.operator for one in self.runs}))

    @property
    def trials(self) -> int:
        """Return the number of measurements per operator and part."""
        return max(one.trial for one in self.runs)


def plan_study(
    name: str, parts: Sequence[str], operators: Sequence[str], trials: int, seed: int
) -> StudyPlan:
    """Return a crossed plan in random order with blind codes; InputError if unsuitable."""
    if len(set(parts)) != len(parts) or len(set(operators)) != len(operators):
        raise InputError(
            "msa.twice", "A part or an operator is named twice.", "Name each of them once."
        )
    count = len(parts) * len(operators) * trials
    if len(parts) < LEAST_PARTS or len(operators) < LEAST_OPERATORS or trials < LEAST_TRIALS:
        raise InputError(
            "msa.too_small",
            f"{len(parts)} parts, {len(operators)} operators and {trials} trials were asked for; "
            f"{LEAST_PARTS}, {LEAST_OPERATORS} and {LEAST_TRIALS} are the least.",
            "10 parts, 3 operators and 3 trials are usual.",
        )
    if count > _MOST:
        raise InputError("msa.too_large", f"{count} measurements.", f"At most {_MOST}.")
    for word in (name, *parts, *operators):
        if fault := label_fault(word):
            raise InputError("msa.name", f"The name {word!r} {fault}.", "Correct the name.")
    rng = np.random.default_rng([seed, 12])
    runs: list[StudyRun] = []
    codes = rng.permutation(count) + 1
    for trial in range(1, trials + 1):
        for operator in (operators[int(i)] for i in rng.permutation(len(operators))):
            for part in (parts[int(i)] for i in rng.permutation(len(parts))):
                code = f"{name}-{int(codes[len(runs)]):0{len(str(count))}}"
                runs.append(StudyRun(code=code, part=part, operator=operator, trial=trial))
    return StudyPlan(schema=STUDY_SCHEMA, unit="mm", name=name, seed=seed, runs=tuple(runs))


def plan_text(plan: StudyPlan) -> str:
    head = {field: getattr(plan, field) for field in ("schema", "unit", "name", "seed")}
    runs = [f"[[runs]]\n{_entries(msgspec.to_builtins(one))}" for one in plan.runs]
    return "\n".join([_entries(head), *runs])


def _entries(values: Mapping[str, object]) -> str:
    # JSON and TOML write text and integers alike.
    return "".join(
        f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items()
    )


def store_plan(path: Path, plan: StudyPlan) -> None:
    """Write a plan to a new file; InputError: it exists; StorageError: it cannot be written."""
    try:
        write_new(path, plan_text(plan).encode("utf-8"))
    except FileExistsError as error:
        raise InputError("msa.exists", f"{path}: the file exists.", "Give another name.") from error
    except OSError as error:
        raise StorageError(
            "msa.store", f"{path}: the plan cannot be written ({error.strerror}).",
            "Give a folder that can be written.",
        ) from error  # fmt: skip


def load_study(path: Path | str) -> StudyPlan:
    """Return a plan; InputError if it is not crossed and balanced, or a code is repeated."""
    plan = load_document(path, StudyPlan, STUDY_SCHEMA)
    require_balanced(plan, str(path))
    return plan


def require_balanced(plan: StudyPlan, where: str) -> None:
    """Raise InputError if a part, operator and trial is missing or repeated."""
    wanted = [
        (part, operator, trial)
        for part in plan.parts
        for operator in plan.operators
        for trial in range(1, plan.trials + 1)
    ]
    found = [(one.part, one.operator, one.trial) for one in plan.runs]
    codes = {one.code for one in plan.runs}
    if sorted(found) != sorted(wanted) or len(codes) != len(found):
        missing = sorted(set(wanted) - set(found))
        what = f"{missing[0]} is missing" if missing else "a measurement or a code is there twice"
        raise InputError(
            "msa.unbalanced",
            f"{where}: the study is not balanced: {what}.",
            "Every operator measures every part equally often; plan it again.",
        )


@dataclass(frozen=True, slots=True)
class CharacteristicStudy:
    name: str
    low: float
    high: float
    """`name`, `low`, `high`: Of the plan; limits may be infinite."""
    study: GaugeStudy | None
    """None if there is none; ``why_not`` has the reason."""
    stated: single.StatedScatter | None
    """OCMM's own uncertainty compared with the observed scatter."""
    from_budget: single.Suitability | None
    from_study: single.Suitability | None
    """`from_budget`, `from_study`: Q by stated uncertainty and by study; None if not two-sided."""
    why_not: str
    values: Float | None = None
    """(parts, operators, trials), mm; None without a study."""


@dataclass(frozen=True, slots=True)
class StudyReport:
    plan: StudyPlan
    measured: int
    """Number of its measurements so far."""
    characteristics: tuple[CharacteristicStudy, ...]
    """In the order of the inspection plan."""
    left_out: tuple[str, ...]
    """Why files do not count, a sentence each."""
    simulated: bool


def open_runs(plan: StudyPlan, serials: set[str]) -> tuple[StudyRun, ...]:
    """Return the missing measurements in order. `serials`: serial numbers of the existing jobs."""
    return tuple(one for one in plan.runs if one.code not in serials)


def study_jobs(
    plan: StudyPlan,
    folder: Path,
    *,
    level: float = AIAG_LEVEL,
    progress: Callable[[str, float], None] = lambda what, share: None,
    probes: Path | None = None,
    calibrations: Path | None = None,
) -> StudyReport:
    """Return the studies of a folder; InputError: none, or under two jobs of a plan."""
    if not folder.is_dir():
        raise InputError("msa.folder", f"{folder}: folder not found.", "Check the name.")
    paths = files_of_folder(folder, SUFFIX)
    return study_of(plan, compare_files(paths, progress, probes, calibrations), level=level)


def study_of(plan: StudyPlan, jobs: Comparison, *, level: float = AIAG_LEVEL) -> StudyReport:
    codes = {one.code for one in plan.runs}
    serials = {part.serial for trend in jobs.trends for part in trend.parts}
    strange = tuple(
        f"Job with serial '{one}' is not in the study." for one in sorted(serials - codes)
    )
    return StudyReport(
        plan=plan,
        measured=len(codes & serials),
        characteristics=tuple(_study(plan, trend, level) for trend in jobs.trends),
        left_out=(*jobs.left_out, *strange),
        simulated=jobs.simulated,
    )


def _study(plan: StudyPlan, trend: Trend, level: float) -> CharacteristicStudy:
    tolerance = trend.high - trend.low
    two_sided = math.isfinite(tolerance)
    try:
        values, stated = _values(plan, trend)
        one_side = next((x for x in (trend.high, trend.low) if math.isfinite(x)), None)
        study = gauge_study(
            values,
            tolerance=tolerance if two_sided else None,
            one_sided=None if two_sided else one_side,
            level=level,
        )
        cells = values.reshape(-1, values.shape[2])
        compared = single.compare_stated(cells, np.sqrt(np.mean(stated**2, axis=2)).ravel())
    except OcmmError as error:
        return CharacteristicStudy(
            trend.name, trend.low, trend.high, None, None, None, None, f"{error.what}"
        )
    budget = found = None
    if two_sided and tolerance > 0.0:
        u = float(np.sqrt(np.mean(stated**2)))
        budget = single.suitability(
            u, single.process_uncertainty(u, study.av, 0.0, 0.0, 0.0), tolerance
        )
        found = single.suitability(study.ev, study.grr, tolerance)
    return CharacteristicStudy(
        trend.name, trend.low, trend.high, study, compared, budget, found, "", values
    )


def _values(plan: StudyPlan, trend: Trend) -> tuple[Float, Float]:
    """Return values and standard uncertainties (parts, operators, trials)."""
    found: dict[str, tuple[float, float]] = {}
    for part in trend.parts:
        if part.value is None or part.uncertainty is None:
            continue
        if part.serial in found:
            raise InputError(
                "msa.twice",
                f"'{part.serial}' was measured twice.",
                "Keep one job of it; which one is decided before the values are looked at.",
            )
        found[part.serial] = part.value, part.uncertainty / COVERAGE_FACTOR
    missing = [one.code for one in plan.runs if one.code not in found]
    if missing:
        raise InputError(
            "msa.unbalanced",
            f"{len(missing)} of {len(plan.runs)} values of this characteristic are missing or "
            f"suspect, '{missing[0]}' first.",
            "Measure them, or plan a smaller study; nothing is filled up.",
        )
    parts, operators = plan.parts, plan.operators
    shape = len(parts), len(operators), plan.trials
    values, stated = np.zeros(shape), np.zeros(shape)
    for one in plan.runs:
        at = parts.index(one.part), operators.index(one.operator), one.trial - 1
        values[at], stated[at] = found[one.code]
    return values, stated


@dataclass(frozen=True, slots=True)
class LinearityReport:
    name: str
    parts: tuple[str, ...]
    """Serial numbers, or parts of the plan, in the order of their references."""
    references: tuple[float, ...]
    biases: tuple[Float, ...]
    """`references`, `biases`: Certified values, and the bias of every result of each, mm."""
    study: single.LinearityStudy
    left_out: tuple[str, ...]
    """Why results do not count, a sentence each."""

    @property
    def word(self) -> str:
        """Return the verdict by AIAG: the zero line within the band of the line, everywhere."""
        return "LINEAR" if self.study.linear else "NOT LINEAR"

    @property
    def reason(self) -> str:
        """Return the reason of the verdict in a sentence."""
        if self.study.linear:
            return "The zero line lies within the 95 % band over the whole range."
        told = []
        if self.study.p_slope < _LEVEL:
            told.append(f"the bias changes by {1e3 * self.study.slope:+.3f} µm per mm")
        if self.study.p_intercept < _LEVEL:
            told.append(f"the line meets zero length at {1e3 * self.study.intercept:+.2f} µm")
        why = " and ".join(told) or "line and scatter together exclude it"
        return f"The zero line leaves the 95 % band: {why}."

    def line(self, at: Float) -> Float:
        """Return the bias of the line at references (n,), mm."""
        bias: Float = self.study.intercept + self.study.slope * at
        return bias


_LEVEL = 0.05


def linearity_of(
    trend: Trend, references: Mapping[str, float], plan: StudyPlan | None = None
) -> LinearityReport:
    """Return the linearity study of one characteristic of jobs.

    `references`: certified value, mm, of every part: by serial number, or by the part of ``plan``.
    `plan`: plan whose codes are the serial numbers of the jobs; None: they name the part.
    InputError: a part has no reference or no result, or there are too few for a study.
    """
    part_of = {} if plan is None else {one.code: one.part for one in plan.runs}
    found: dict[str, list[float]] = {name: [] for name in references}
    left_out, unknown = [*trend.left_out], dict[str, int]()
    for one in trend.parts:
        part = one.serial if plan is None else part_of.get(one.serial, "")
        if part not in found:
            unknown[part or one.serial] = unknown.get(part or one.serial, 0) + 1
        elif one.value is None:
            left_out.append(f"Job {one.job} of part {part} has no value that counts.")
        else:
            found[part].append(one.value)
    if unknown:
        names = ", ".join(f"{name} ({count})" for name, count in sorted(unknown.items()))
        raise InputError(
            "msa.reference",
            f"Jobs of parts without a reference: {names}.",
            "Give the reference of each of them, or take their jobs out of the folder.",
        )
    order = sorted(references, key=lambda name: references[name])
    empty = [name for name in order if not found[name]]
    if empty:
        raise InputError(
            "msa.reference",
            f"There is no result of part {', '.join(empty)}.",
            "Measure the part, or leave its reference out.",
        )
    values = [references[name] for name in order]
    study = single.linearity_study(values, [found[name] for name in order])
    biases = tuple(np.array(found[name]) - references[name] for name in order)
    return LinearityReport(trend.name, tuple(order), tuple(values), biases, study, tuple(left_out))
