"""The steps of whole plans as seen by a window: job views, and the places of the ball meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import (
    FeatureState,
    FeatureView,
    JobView,
    PlannedFeature,
    SessionOptions,
    Target,
    places_of,
)
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import TouchCollector
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part

_RATE_HZ = 500
_LIFTS_MM = (0.0, 20.0, 60.0)


@dataclass(frozen=True, slots=True)
class Step:
    """The view at one moment: the job, and the place of the ball, (3,), mm, world."""

    job: JobView
    ball_world: Float


def measured_steps(name: str, folder: Path, model: PartModel | None = None) -> Iterator[Step]:
    """Yield the steps of a plan of ``resources`` as it is measured on the virtual rig.

    A model in the frame of the nominals is placed roughly until the job determines its place.
    """
    rig_file, probe_file = resource("rigs", "recommended.toml"), resource("probes", "standard.toml")
    rig, body = load_rig(rig_file), load_probe(probe_file)
    plan_file = resource("plans", name)
    plan = load_plan(plan_file)
    part = load_part(resource("parts", name if name == "gauge.toml" else "demo.toml"))
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, script, seed=1, frame_rate_hz=_RATE_HZ)
    options = SessionOptions()
    collector = TouchCollector(1.0 / _RATE_HZ, options.point)
    pipeline = TrackingPipeline(rig, body)
    touches = iter(collector.push(pipeline.process(virtual.frames(0, virtual.n_frames))))
    head = make_head(
        plan=plan_file, rig=rig_file, probe=probe_file, operator="me", part=plan.part, serial="1"
    )
    place = part.T_world_from_part

    def seen(job: JobView) -> JobView:
        if model is None:
            return job
        rough = job.target is None or job.target.approximate
        planned = job.planned
        if planned is not None and planned.supposed:
            planned = moved_to(planned, place)
        return replace(job, placed_part=PlacedPart(model, place, rough), planned=planned)

    with JobFile.create(folder / "steps.ocmm", head) as job:
        session = InspectionSession(plan, rig, body, job, options)
        for feature in plan.features:
            for _ in range(feature.points):
                before = seen(session.view)
                session.touches.record_touch(next(touches), feature.name)
                after = seen(session.view)
                point = after.feature(feature.name).points[-1]
                for lift in _LIFTS_MM[::-1]:
                    yield Step(before, point.tip_world + lift * point.direction)
                yield Step(after, point.tip_world)


def moved_to(planned: PlannedFeature, place: RigidTransform) -> PlannedFeature:
    """Return the first target on a part supposed elsewhere."""
    motion = place.compose(planned.T_world_from_nominal.inverse())
    targets = tuple(
        replace(
            target,
            surface_world=motion.apply(target.surface_world),
            normal_world=motion.rotation @ target.normal_world,
            ball_world=motion.apply(target.ball_world),
        )
        for target in planned.targets
    )
    return replace(planned, T_world_from_nominal=place, targets=targets)


def nominal_steps(
    features: tuple[NominalFeature, ...], model: PartModel, empty: JobView
) -> Iterator[Step]:
    """Give the steps of a plan of a model: the ball goes to every place that is to be touched."""
    place = RigidTransform(
        rotation_from_vector(np.array([0.3, 0.1, 0.8])), np.array([10.0, -20.0, -60.0])
    )
    placed = PlacedPart(model, place, is_rough=True)
    for nominal in features:
        touched = places_of(nominal, max(nominal.points, nominal.shape.spec.minimum_points))
        surface = place.apply(touched.points)
        normals = touched.normals @ place.rotation.T
        targets = tuple(
            Target(nominal.name, point, normal, point + 3.0 * normal, approximate=True)
            for point, normal in zip(surface, normals, strict=True)
        )
        for number, target in enumerate(targets):
            feature = FeatureView(
                nominal.name, nominal.shape, len(targets), FeatureState.ACTIVE, (), None, "",
                targets=targets[number:],
            )  # fmt: skip
            job = replace(
                empty, features=(feature,), active=nominal.name, target=target,
                placed_part=placed, planned=PlannedFeature(nominal, place, supposed=False),
            )  # fmt: skip
            for lift in _LIFTS_MM[::-1]:
                yield Step(job, target.ball_world + lift * target.normal_world)
