"""What jobs of one plan say together: trend, control chart and capability of characteristics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.named_file import FileIdentity
from ocmm_core.tolerances.decisions import (
    ControlChart,
    ProcessCapability,
    Verdict,
    capability,
    control_chart,
)
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic

_ROOM = 1.12
"""A scale is so much longer than what it shows."""


@dataclass(frozen=True, slots=True)
class PartValue:
    """One characteristic of one part."""

    job: str
    serial: str
    created_utc: str
    """`job`, `serial`, `created_utc`: Of its job."""
    value: float | None
    uncertainty: float | None
    """`value`, `uncertainty`: Measured value and U (95 %); None where there is none."""
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Trend:
    """One characteristic over all parts."""

    name: str
    kind: str
    """`name`, `kind`: As in the plan."""
    low: float
    high: float
    """`low`, `high`: Limits of the value; infinite where there is none."""
    parts: tuple[PartValue, ...]
    """In the order in which the jobs were begun."""
    left_out: tuple[str, ...]
    """Why parts are not counted, a sentence each; empty where all are."""
    chart: ControlChart | None
    capability: ProcessCapability | None
    """`chart`, `capability`: None where there is nothing to say; ``why_not`` then says why."""
    why_not: str
    """A sentence, or empty."""
    features: tuple[str, ...] = ()
    """That the characteristic is about, with its datums."""

    @property
    def values(self) -> Float:
        """Return the values that are counted, (n,)."""
        return np.array([part.value for part in self.parts if part.value is not None])

    @property
    def caution(self) -> str:
        """Return what must be known before the indices are used; empty where nothing must."""
        if self.chart is None or self.capability is None or not self.chart.signals:
            return ""
        return "Not in control: find the causes of the signals before Cp and Cpk are used."

    def span(self) -> tuple[float, float]:
        """Return the ends of a scale for values, their uncertainties, and both kinds of limits."""
        ends = [value for value in (self.low, self.high) if math.isfinite(value)]
        if self.chart is not None:
            ends += [self.chart.low, self.chart.high]
        for part in self.parts:
            if part.value is not None and part.uncertainty is not None:
                ends += [part.value - part.uncertainty, part.value + part.uncertainty]
        middle = 0.5 * (min(ends) + max(ends))
        half = _ROOM * 0.5 * max(max(ends) - min(ends), 1e-6)
        return middle - half, middle + half


@dataclass(frozen=True, slots=True)
class Comparison:
    """Jobs of one plan side by side."""

    plan: str
    """Name of the plan that they were measured by."""
    jobs: tuple[str, ...]
    """Names of the jobs, in the order in which they were begun."""
    words: tuple[str, ...]
    """What each of them is and what its part is."""
    trends: tuple[Trend, ...]
    """One for every characteristic."""
    left_out: tuple[str, ...]
    """Why files are not compared, a sentence each."""
    unread: tuple[str, ...]
    """Those of them about files that could not be read."""
    simulated: bool
    """What is counted came from a virtual rig."""
    files: tuple[FileIdentity, ...] = ()
    """The job files that were read on this computer."""

    def require_names(self) -> None:
        """Raise StorageError if a job is no longer on the disk under its name."""
        for file in self.files:
            file.require_name()

    def about(self, feature: str) -> Comparison:
        """Return what is about a feature; everything where its name is empty.

        Raises
        ------
        InputError
            No characteristic is about it.
        """
        if not feature:
            return self
        found = tuple(trend for trend in self.trends if feature in trend.features)
        if not found:
            known = sorted({name for trend in self.trends for name in trend.features})
            raise InputError(
                "compare.feature",
                f"No characteristic is about feature {feature!r}.",
                f"Choose from {', '.join(known)}.",
            )
        return replace(self, trends=found)


@dataclass(frozen=True, slots=True)
class PartJob:
    """What a comparison takes of a job; little enough to come from another process."""

    path: Path
    name: str
    uuid: str
    serial: str
    created_utc: str
    plan: str
    plan_text: str
    """`path` to `plan_text`: Of the job and its plan."""
    characteristics: tuple[Characteristic, ...]
    values: tuple[tuple[tuple[float, float] | None, str, Verdict], ...]
    """For each of them value and U (95 %), or None; why it is not counted, or nothing; its verdict.
    Whether the job is simulated beside real ones is not looked at here."""
    simulated: bool
    """It came from a virtual rig."""
    words: str
    """What the job is and what its part is, in a line."""
    file: FileIdentity | None


def trends_of(jobs: Sequence[PartJob]) -> tuple[Trend, ...]:
    if len(jobs) < 2:
        raise InputError(
            "compare.too_few",
            f"There {'is 1 job' if jobs else 'is no job'} to compare.",
            "Choose two jobs of one plan or more.",
        )
    first = jobs[0]
    for job in jobs[1:]:
        if job.plan_text != first.plan_text:
            raise InputError(
                "compare.plan",
                f"{job.path} was measured with another plan than {first.path}.",
                "Compare jobs of one plan; a changed plan counts as another.",
            )
    seen: set[str] = set()
    for job in jobs:
        if job.uuid in seen:
            raise InputError(
                "compare.twice",
                f"{job.path}: this job is selected twice, possibly as a copy.",
                "Select it once.",
            )
        seen.add(job.uuid)
    ordered = sorted(jobs, key=lambda job: job.created_utc)
    return tuple(_trend(index, item, ordered) for index, item in enumerate(first.characteristics))


def all_simulated(jobs: Sequence[PartJob]) -> bool:
    """Return whether all jobs came from virtual rigs, so that what they say together did, too."""
    return all(job.simulated for job in jobs)


def _trend(index: int, item: Characteristic, jobs: Sequence[PartJob]) -> Trend:
    left_out = []
    counted = []
    parts = []
    computed = all_simulated(jobs)
    for job in jobs:
        stated, why, verdict = job.values[index]
        if job.simulated and not computed:
            stated = None
            why = f"{SIMULATED}. {NO_REAL_PART} Compare simulated jobs separately."
        if stated is None:
            left_out.append(f"{job.name}: {why}")
        else:
            counted.append(stated)
        parts.append(
            PartValue(
                job=job.name,
                serial=job.serial,
                created_utc=job.created_utc,
                value=None if stated is None else stated[0],
                uncertainty=None if stated is None else stated[1],
                verdict=verdict,
            )
        )
    low = -math.inf if spec_of(item.kind).one_sided else item.nominal + item.lower
    high = item.nominal + item.upper
    chart, able, why_not = None, None, ""
    values = np.array([value for value, _ in counted])
    try:
        chart = control_chart(values)
        middle = float(np.median([u for _, u in counted])) / COVERAGE_FACTOR
        able = capability(values, low, high, middle)
    except OcmmError as error:
        why_not = f"{error.what} {error.remedy}"
    return Trend(
        item.name, item.kind, low, high, tuple(parts), tuple(left_out), chart, able, why_not,
        tuple(dict.fromkeys((*item.features, *item.datums))),
    )  # fmt: skip
