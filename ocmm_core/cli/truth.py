"""What a plan would find on the virtual rig if nothing were wrong."""

from __future__ import annotations

from ocmm_core.features.shapes import element
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import Plan
from ocmm_core.simulation.artefacts import Part, TrueFeature
from ocmm_core.tolerances.measure import geometry_value


def true_values(plan: Plan, part: Part) -> dict[str, float]:
    """Return the true value of every characteristic, mm, by name.

    Surfaces of the virtual part have no form error, so the true form is zero.
    """
    features = part.features_part()
    geometries = {feature.name: _geometry(features[feature.name]) for feature in plan.features}
    shapes = {feature.name: feature.shape for feature in plan.features}
    return {
        item.name: 0.0
        if item.kind == "form"
        else geometry_value(item, geometries, shapes, plan.alignment)
        for item in plan.characteristics
    }


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
