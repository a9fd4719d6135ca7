"""True values of a plan on the virtual rig."""

from __future__ import annotations

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import measured
from ocmm_core.features.shapes import element
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.kinds import evaluate, geometry_value, spec_of, taken_again
from ocmm_sim.scene import Part, TrueFeature, sample

TOUCHES = 40
"""Exact touches per surface: the zone of a tilted face depends on the extent touched."""
SEED = 1
_BALL_MM = 1.0


def true_values(plan: Plan, part: Part) -> dict[str, float]:
    """Return the true value of each characteristic, mm or deg, by name.

    Surfaces of the virtual part have no form error: true form is zero. Characteristics in a zone or
    in a frame of ordered datums are evaluated as in a job, from exact touches. Characteristics that
    the part does not determine are missing.
    """
    features = part.features_part()
    actual = _exact(plan, part)
    geometries = {
        item.name: actual[item.name].fit.geometry if item.sheet else _geometry(features[item.name])
        for item in plan.features
    }
    for construction in plan.constructions:
        if construction.name in actual:
            geometries[construction.name] = actual[construction.name].fit.geometry
    found = {}
    for item in plan.characteristics:
        spec = spec_of(item.kind)
        if spec.form_alone:
            found[item.name] = 0.0
        elif spec.geometry is None or taken_again(item, actual, plan.bound_alignment):
            # A datum out of square turns the frame by its surface, not its normal.
            try:
                found[item.name] = evaluate(item, actual, plan.bound_alignment).value
            except FitError:
                continue
        else:
            found[item.name] = geometry_value(item, geometries, plan.shapes, plan.bound_alignment)
    return found


def _exact(plan: Plan, part: Part) -> dict[str, measured.ActualFeature]:
    """Return the features of a plan fitted to exact touches, part frame."""
    rng = np.random.default_rng(SEED)
    points: list[MeasuredPoint] = []
    for feature in plan.features:
        contacts = sample(part.artefact(feature.name), max(feature.points, TOUCHES), rng)
        for surface, normal in zip(contacts.points, contacts.normals, strict=True):
            points.append(_touch(feature.name, len(points) + 1, surface, normal))
    actual = measured.actual_features(plan.features, points)
    nominals = measured.nominal_geometries(plan.features, plan.constructions)
    actual |= measured.constructed_features(plan.constructions, actual, nominals)
    return {name: item for name, item in actual.items() if isinstance(item, measured.ActualFeature)}


def _touch(feature: str, number: int, surface: Float, normal: Float) -> MeasuredPoint:
    return MeasuredPoint(
        number=number,
        feature=feature,
        time_s=float(number),
        first_frame=0,
        last_frame=0,
        n_frames=1,
        tip_world=surface + _BALL_MM * normal,
        random_covariance=np.zeros((3, 3)),
        direction=normal,
        tip_radius=_BALL_MM,
        rotation_world_from_probe=np.eye(3),
        spots=np.zeros((0, 0, 2)),
        chi2_per_dof=0.0,
        approach="nominal",
    )


def _geometry(feature: TrueFeature) -> Float:
    radius = 0.5 * feature.length if feature.length > 0.0 else 0.5 * feature.diameter
    # The radius of a virtual cone falls along its direction, that of a fitted one grows.
    sense = -1.0 if feature.half_angle > 0.0 else 1.0
    return element(
        feature.point,
        sense * feature.direction,
        radius,
        second=0.5 * feature.width,
        half_angle=feature.half_angle,
        across=feature.along,
    )
