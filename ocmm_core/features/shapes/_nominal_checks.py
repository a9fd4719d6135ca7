from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes._nominal import CRITERIA, NominalFeature
from ocmm_core.features.shapes._shape import Shape

_ROUND_ENDS = (Shape.ELLIPSE, Shape.ROUND_SLOT)
"""Outlines that are circles for equal sizes."""

SQUARE = 1e-6
"""Cosine of the angle between a normal and a direction in its plane."""


def shape_fault(feature: NominalFeature) -> tuple[str, str] | None:
    """Return the first faulty field and its fault, or None."""
    spec = feature.shape.spec
    if spec.has_size("diameter") != (feature.diameter > 0.0):
        return (
            "diameter",
            f"is {feature.diameter}; circle, sphere, cylinder, cone and torus have a diameter "
            "greater than zero, other shapes have none",
        )
    if spec.has_size("angle_deg") != (feature.angle_deg != 0.0):
        return "angle_deg", f"is {feature.angle_deg:g}; a cone has one, other shapes have none"
    if spec.has_size("angle_deg") and not 0.0 < feature.angle_deg < 179.0:
        return "angle_deg", f"is {feature.angle_deg:g}; it is the full angle, 0 to 179"
    if feature.shape is Shape.TORUS and not 0.0 < feature.width < feature.diameter:
        return (
            "width",
            f"is {feature.width:g}; it is the diameter of the tube of a torus, smaller than that "
            "of its centre line",
        )
    if spec.has_across:
        return _outline_fault(feature) or _criterion_fault(feature)
    for size in spec.sizes:
        if not getattr(feature, size.field) > 0.0:
            return size.field, f"is not greater than zero; it is the {size.word}"
    if feature.free and (not spec.may_be_free or feature.projection):
        return "free", "is only for circles that are not projected"
    if feature.projection and not spec.is_flat:
        return "projection", "is only for circles, ellipses, slots and rectangles"
    return _criterion_fault(feature)


def _criterion_fault(feature: NominalFeature) -> tuple[str, str] | None:
    word = feature.criterion
    if word == "least squares":
        return None
    if feature.projection:
        return "criterion", f"is {word!r}; what is projected is fitted by least squares"
    offered = CRITERIA[word] in feature.shape.spec.criteria
    if word == "minimum zone" and not offered:
        return "criterion", f"is {word!r}; a {feature.shape.value.lower()} has no zone"
    if word != "minimum zone" and (not offered or feature.free):
        return (
            "criterion",
            f"is {word!r}, which is for circles in their own plane, spheres and cylinders",
        )
    return None


def _outline_fault(feature: NominalFeature) -> tuple[str, str] | None:
    if feature.free:
        return "free", "is only for circles that are not projected"
    for field, value in (("length", feature.length), ("width", feature.width)):
        if not value > 0.0:
            return field, f"is {value:g}; ellipse, slot and rectangle have length and width"
    if feature.width > feature.length:
        return "width", f"is {feature.width:g}, more than the length; the longer one is the length"
    if feature.width == feature.length and feature.shape in _ROUND_ENDS:
        return "width", "is the length; measure it as a circle"
    across, normal = np.array(feature.across), np.array(feature.direction)
    lengths = float(np.linalg.norm(across) * np.linalg.norm(normal))
    if not lengths > 0.0 or abs(float(across @ normal)) > SQUARE * lengths:
        return "across", "is not square to 'direction'; it is the direction of the length"
    return None
