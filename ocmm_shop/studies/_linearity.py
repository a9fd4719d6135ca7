"""Linearity from jobs: the bias of several calibrated parts over the range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive import Trend
from ocmm_shop.studies._plan import StudyPlan
from ocmm_shop.studies._single import LinearityStudy, linearity_study


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
