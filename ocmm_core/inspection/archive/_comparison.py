"""Result of a comparison of jobs: trend, control chart and capability per characteristic."""

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
"""Length of a scale relative to its content."""


@dataclass(frozen=True, slots=True)
class PartValue:
    job: str
    serial: str
    created_utc: str
    value: float | None
    uncertainty: float | None
    """`value`, `uncertainty`: Measured value and U (95 %), or None."""
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Trend:
    name: str
    kind: str
    low: float
    high: float
    """`low`, `high`: Limits of the value, may be infinite."""
    parts: tuple[PartValue, ...]
    """In the order of the starts of the jobs."""
    left_out: tuple[str, ...]
    """Reasons for not counting parts, a sentence each."""
    chart: ControlChart | None
    capability: ProcessCapability | None
    """`chart`, `capability`: None if not computed; ``why_not`` has the reason."""
    why_not: str
    features: tuple[str, ...] = ()
    """Features of the characteristic, with its datums."""

    @property
    def values(self) -> Float:
        """Return the counted values, (n,)."""
        return np.array([part.value for part in self.parts if part.value is not None])

    @property
    def caution(self) -> str:
        """Return a warning about the indices of a process out of control; empty without one."""
        if self.chart is None or self.capability is None or not self.chart.signals:
            return ""
        return "Not in control: find the causes of the signals before Cp and Cpk are used."

    def span(self) -> tuple[float, float]:
        """Return the ends of an axis for values, their uncertainties, and both kinds of limits."""
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
    jobs: tuple[str, ...]
    """In the order of their starts."""
    words: tuple[tuple[str, ...], ...]
    """Per job: states and the verdict on the part, each a sentence."""
    trends: tuple[Trend, ...]
    left_out: tuple[str, ...]
    """Reasons for not comparing files, a sentence each."""
    unread: tuple[str, ...]
    """The reasons in ``left_out`` about unreadable files."""
    simulated: bool
    """The counted jobs came from a virtual rig."""
    files: tuple[FileIdentity, ...] = ()

    def require_names(self) -> None:
        """Raise StorageError if a job is not on the disk under its name any more."""
        for file in self.files:
            file.require_name()

    def about(self, feature: str) -> Comparison:
        """Return the trends of a feature, all for an empty name; InputError without any."""
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
    """Data of a job for a comparison; small enough to come from another process."""

    path: Path
    name: str
    uuid: str
    serial: str
    created_utc: str
    plan: str
    plan_text: str
    characteristics: tuple[Characteristic, ...]
    values: tuple[tuple[tuple[float, float] | None, str, Verdict], ...]
    """Per characteristic: value and U (95 %), or None; reason for not counting it; verdict.

    Ignores mixing of simulated and real jobs."""
    simulated: bool
    words: tuple[str, ...]
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
    """Return whether all jobs, and so their comparison, are simulated."""
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
