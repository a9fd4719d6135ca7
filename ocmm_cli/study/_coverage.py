"""Coverage of value ± U (k = 2) over seeded virtual rigs.

Every run draws its own true cameras, probe and ball from the covariance of the documents, its own
sensor pattern and spot noise, and measures the whole part. Frames come at 500 Hz instead of 8 kHz
to save time; the stated uncertainty follows, because it is computed from the available frames.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig, load_rig
from ocmm_core.cleanup import scratch_folder
from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.composition import DEMO_PART, DEMO_PLAN, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import read_bytes
from ocmm_core.errors import OcmmError
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import PointOptions, Refusal, TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe
from ocmm_sim.scene import Part, VirtualRig, load_part
from ocmm_sim.sources import true_values

FRAME_RATE_HZ = 500

Kind = Literal["distance", "coordinate"]
Axis = Literal["", "x", "y", "z"]
_AXES: tuple[Axis, ...] = ("x", "y", "z")
_PARALLEL = 1.0 - 1e-9
"""Cosine between normals of nominally parallel features."""
_BATCH = 800
_MOST_ROUNDS = 3
"""Number of rounds of retries of refused touches."""


@dataclass(frozen=True, slots=True)
class CoverageSetup:
    """Paths of the documents of all runs."""

    plan: Path = DEMO_PLAN
    rig: Path = RECOMMENDED_RIG
    probe: Path = STANDARD_PROBE
    part: Path = DEMO_PART


@dataclass(frozen=True, slots=True)
class CoverageOutcome:
    """One characteristic of one run: error and stated U, mm; NaN if not measured."""

    name: str
    error: float
    uncertainty: float


def _run(setup: CoverageSetup, seed: int) -> list[CoverageOutcome]:
    """Measure the part once and compare with the truth of that run."""
    plan = more_characteristics(load_plan(setup.plan))
    rig, body, part = load_rig(setup.rig), load_probe(setup.probe), load_part(setup.part)
    with tempfile.TemporaryDirectory() as folder:
        head = make_head(
            plan=setup.plan, rig=setup.rig, probe=setup.probe, operator="", part="", serial=""
        )
        with JobFile.create(Path(folder) / "job.ocmm", head) as job:
            return _measure(plan, rig, body, part, job, seed)


def run_coverage(
    setup: CoverageSetup,
    seeds: Sequence[int],
    site: Site = HERE,
    told: Callable[[int], None] = lambda done: None,
) -> list[list[CoverageOutcome]]:
    """Measure once for every seed; results do not depend on the site.

    Workers get the contents of the documents; ``told`` receives the number of finished runs.
    OcmmError if a run failed, or the site cannot be used.
    """
    documents = tuple(read_bytes(path) for path in (setup.plan, setup.rig, setup.probe, setup.part))
    found = []
    for answer in run_tasks(
        _run_from, seeds, lambda seed: f"The measurement with seed {seed}",
        site=site, contents=partial(_documents, documents), on_done=told,
    ):  # fmt: skip
        if isinstance(answer, OcmmError):
            raise answer
        found.append(answer)
    return found


def _documents(documents: tuple[bytes, ...], seed: int) -> tuple[bytes, ...]:
    return documents


def _run_from(seed: int, *documents: bytes) -> list[CoverageOutcome]:
    """Measure once with the contents of documents."""
    with scratch_folder("coverage") as folder:
        paths = [folder / f"{name}.toml" for name in ("plan", "rig", "probe", "part")]
        for path, content in zip(paths, documents, strict=True):
            path.write_bytes(content)
        return _run(CoverageSetup(*paths), seed)


def more_characteristics(plan: Plan) -> Plan:
    """Return the plan with characteristics of location for all features that have one, no form.

    Points and planes get a distance to the first parallel plane, centres their coordinates if there
    is a part frame. The true form is zero, and a range of residuals can only be greater: no
    interval about it could cover the truth in 95 of 100 runs.
    """
    kept = [item for item in plan.characteristics if not spec_of(item.kind).form_alone]
    stated = {(item.kind, frozenset(item.features), item.axis) for item in kept}
    extra = [
        item
        for feature in plan.features
        for item in _place_of(plan, feature)
        if (item.kind, frozenset(item.features), item.axis) not in stated
    ]
    return msgspec.structs.replace(plan, characteristics=kept + extra)


def _place_of(plan: Plan, feature: NominalFeature) -> Iterator[Characteristic]:
    """Yield the characteristics of a feature's location."""
    shape = feature.shape.spec
    if shape.located == "along" or shape.minimum_points == 1:
        for base in plan.features:
            if base is feature:
                return
            if base.shape.spec.located == "along" and (
                shape.minimum_points == 1 or _are_parallel(base, feature)
            ):
                name = f"{feature.name} above {base.name}"
                yield _extra(name, "distance", [feature.name, base.name])
                return
    elif shape.located == "everywhere" and shape.centred and plan.bound_alignment is not None:
        for axis in _AXES:
            yield _extra(f"{feature.name} {axis}", "coordinate", [feature.name], axis)


def _are_parallel(one: NominalFeature, other: NominalFeature) -> bool:
    first, second = np.array(one.direction), np.array(other.direction)
    product = np.linalg.norm(first) * np.linalg.norm(second)
    return bool(abs(first @ second) >= _PARALLEL * product)


def _extra(name: str, kind: Kind, features: list[str], axis: Axis = "") -> Characteristic:
    return Characteristic(
        name=name, kind=kind, features=features, nominal=0.0, lower=0.0, upper=0.0, axis=axis
    )


def _measure(
    plan: Plan, rig: Rig, body: ProbeBody, part: Part, job: JobFile, seed: int
) -> list[CoverageOutcome]:
    touches = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, touches, seed, frame_rate_hz=FRAME_RATE_HZ)
    pipeline = TrackingPipeline(rig, body)
    collector = TouchCollector(virtual.frame_period_ns * 1e-9, PointOptions())
    session = InspectionSession(plan, rig, body, job, SessionOptions())
    touch_all(virtual, touches, session, pipeline, collector)
    truth = true_values(plan, part)
    return [
        CoverageOutcome(
            item.name,
            np.nan if item.measured is None else item.measured - truth[item.name],
            np.nan if item.uncertainty is None else item.uncertainty,
        )
        for item in session.view.characteristics
    ]


def touch_all(
    virtual: VirtualRig,
    touches: Sequence[tuple[str, int]],
    session: InspectionSession,
    pipeline: TrackingPipeline,
    collector: TouchCollector,
    seen: Callable[[FrameBlock], FrameBlock] = lambda block: block,
) -> None:
    """Record all touches of a virtual rig in a session, and retry refused ones.

    ``touches``: features and numbers of touches; ``seen`` modifies frames before the pipeline.
    """
    meant = [name for name, count in touches for _ in range(count)]
    first = taken = rounds = 0
    while first < virtual.n_frames:
        count = min(_BATCH, virtual.n_frames - first)
        for touch in collector.push(pipeline.process(seen(virtual.frames(first, count)))):
            if isinstance(session.touches.record_touch(touch, meant[taken]), Refusal):
                meant.append(meant[taken])
            taken += 1
        first += count
        # Operators repeat refused touches.
        if first >= virtual.n_frames and taken < len(meant) and rounds < _MOST_ROUNDS:
            rounds += 1
            virtual.extend([(name, 1) for name in meant[taken:]], first)


def coverage_table(
    runs: Sequence[Sequence[CoverageOutcome]],
) -> list[tuple[str, float, float, float, int]]:
    """Return name, coverage, mean U and RMS error (mm) of every characteristic where it has U.

    The last number is that of the runs without U: value not shown, or shown without U.
    """
    rows = []
    for outcomes in zip(*runs, strict=True):
        known = [item for item in outcomes if np.isfinite(item.error * item.uncertainty)]
        errors = np.array([outcome.error for outcome in known])
        stated = np.array([outcome.uncertainty for outcome in known])
        share, mean, rms = np.nan, np.nan, np.nan
        if known:
            share, mean = np.mean(np.abs(errors) <= stated), stated.mean()
            rms = np.sqrt(np.mean(errors**2))
        without = len(outcomes) - len(known)
        rows.append((outcomes[0].name, float(share), float(mean), float(rms), without))
    return rows
