"""Studies from recalculated jobs, one per characteristic (`inspection.archive`).

Suspect values count as missing; an unbalanced study is refused, not filled up. Linearity is the
bias of several calibrated parts over the range.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive import SUFFIX, Comparison, Trend, compare_files
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_shop.studies._gauge_rr import AIAG_LEVEL, GaugeStudy, gauge_study
from ocmm_shop.studies._plan import StudyPlan, StudyRun
from ocmm_shop.studies._single import (
    LinearityStudy,
    StatedScatter,
    Suitability,
    compare_stated,
    linearity_study,
    process_uncertainty,
    suitability,
)


@dataclass(frozen=True, slots=True)
class CharacteristicStudy:
    name: str
    low: float
    high: float
    """`name`, `low`, `high`: Of the plan; limits may be infinite."""
    study: GaugeStudy | None
    """None if there is none; ``why_not`` has the reason."""
    stated: StatedScatter | None
    """OCMM's own uncertainty compared with the observed scatter."""
    from_budget: Suitability | None
    from_study: Suitability | None
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
        own = np.sqrt(np.mean(stated**2, axis=2)).ravel()
        compared = compare_stated(cells, own)
    except OcmmError as error:
        return CharacteristicStudy(
            trend.name, trend.low, trend.high, None, None, None, None, f"{error.what}"
        )
    budget = found = None
    if two_sided and tolerance > 0.0:
        u = float(np.sqrt(np.mean(stated**2)))
        budget = suitability(u, process_uncertainty(u, study.av, 0.0, 0.0, 0.0), tolerance)
        found = suitability(study.ev, study.grr, tolerance)
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
    study: LinearityStudy
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
    study = linearity_study(values, [found[name] for name in order])
    biases = tuple(np.array(found[name]) - references[name] for name in order)
    return LinearityReport(trend.name, tuple(order), tuple(values), biases, study, tuple(left_out))
