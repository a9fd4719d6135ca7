"""The nominal part of a job, and its assumed pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.inspection.evaluation import (
    PlannedFeature,
    Target,
    Whereabouts,
    places_of,
    targets_of,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import PartModel, PlacedPart


class PlacedNominal:
    """Nominal part of a job from its CAD model; initially the one in its file."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger
        self._model = ledger.job.part()

    @property
    def model(self) -> PartModel | None:
        return self._model

    def show(self, model: PartModel) -> None:
        """Make a part durable and show it; the first one counts; StorageError if not durable."""
        with self._ledger.lock:
            if self._model is None:
                self._ledger.job.store_part(model)
                self._model = model
                self._ledger.view = None


def placed(model: PartModel | None, place: Whereabouts | None, rig: Rig) -> PlacedPart | None:
    """Return a part in its pose, else upright in mid-volume; None without part."""
    if model is None:
        return None
    if place is None:
        return PlacedPart(model, _in_the_middle(model.box, rig), is_rough=True)
    return PlacedPart(model, place.T_nominal_from_world.inverse(), is_rough=place.approximate)


def planned_feature(
    plan: Plan,
    name: str,
    points: Sequence[MeasuredPoint],
    place: Whereabouts | None,
    placed_part: PlacedPart | None,
    rig: Rig,
    tip_radius: float,
) -> PlannedFeature:
    """Return a feature by its nominals, to be shown before it is measured.

    While the part's pose is unknown it is where the part is shown, not for guidance. Each of
    `points` replaces a target. `tip_radius`: mm.
    """
    nominal = plan.feature(name)
    if place is not None:
        return PlannedFeature(nominal, place.T_nominal_from_world.inverse(), supposed=False)
    if placed_part is not None:
        there = placed_part.T_world_from_model
    else:
        there = _in_the_middle(_box_of(plan), rig)
    supposed = Whereabouts(there.inverse(), approximate=True)
    targets = targets_of(plan, name, points, supposed, tip_radius, None)
    if not targets and not places_of(nominal, nominal.points).points.size:
        # Its size is not in the plan: show its middle.
        middle = there.apply(np.array(nominal.point))
        normal = np.zeros(3)
        if nominal.shape.spec.spread == "plane":
            normal = there.rotation @ unit(np.array(nominal.direction))
        ball = middle + tip_radius * normal
        targets = (Target(name, middle, normal, ball, approximate=True),)
    return PlannedFeature(nominal, there, supposed=True, targets=targets)


def _box_of(plan: Plan) -> Float:
    places = [places_of(one, one.points).points for one in plan.features]
    every = np.concatenate([*places, [one.point for one in plan.features]])
    return np.stack([every.min(axis=0), every.max(axis=0)])


def _in_the_middle(box: Float, rig: Rig) -> RigidTransform:
    # Upright is opposite to the columns of the sensors.
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up = -np.sign(columns[axis]) * np.eye(3)[axis]
    turn = np.cross([0.0, 0.0, 1.0], up)
    length = float(np.linalg.norm(turn))
    if length > 0.0:
        rotation = rotation_from_vector(turn / length * np.arctan2(length, up[2]))
    else:
        rotation = np.diag([1.0, np.sign(up[2]), np.sign(up[2])])
    middle = rig.volume_world.mean(axis=0)
    return RigidTransform(rotation, middle - rotation @ box.mean(axis=0))
