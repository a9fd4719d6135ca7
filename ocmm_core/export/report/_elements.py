"""Nominal and actual elements as reported: full sizes, unit vectors, degrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.shapes import Fit, NominalFeature
from ocmm_core.geometry import Float, RigidTransform, unit


@dataclass(frozen=True, slots=True)
class Element:
    """A nominal or actual element as reported; None for what its shape lacks."""

    point: Float
    """(3,), mm: centre or point on the element."""
    direction: Float | None
    across: Float | None = None
    """`direction`, `across`: (3,), unit: normal or axis, and the direction of the length."""
    diameter: float | None = None
    """mm: of a cone square to its axis at ``point``; of the centre line of a torus."""
    length: float | None = None
    width: float | None = None
    """`length`, `width`: mm: of slot, rectangle and ellipse, over all; the width of a torus is that
    of its tube. Of other shapes the nominal length along the axis, if in the plan."""
    angle_deg: float | None = None
    """Full apex angle of a cone."""


def element_of_nominal(nominal: NominalFeature, frame: RigidTransform) -> Element:
    """Return a nominal in another frame, without properties that the shape lacks."""
    shape = nominal.shape
    across = unit(np.array(nominal.across)) if shape.spec.has_across else None
    return Element(
        point=frame.apply(np.array(nominal.point, dtype=np.float64)),
        # A sphere has no direction, regardless of the plan's default.
        direction=(
            frame.rotation @ unit(np.array(nominal.direction))
            if shape.spec.planned_direction
            else None
        ),
        across=None if across is None else frame.rotation @ across,
        diameter=nominal.diameter or None,
        length=nominal.length or None,
        width=nominal.width or None,
        angle_deg=nominal.angle_deg or None,
    )


def element_of_fit(fit: Fit, frame: RigidTransform) -> Element:
    """Return a fit (world frame) in another frame, with full sizes instead of half ones."""
    sizes = {size.field: size.whole(fit.geometry) or None for size in fit.shape.spec.sizes}
    return Element(
        point=frame.apply(fit.point),
        direction=frame.rotation @ fit.direction if fit.direction.any() else None,
        across=frame.rotation @ fit.across if fit.across.any() else None,
        diameter=sizes.get("diameter"),
        length=sizes.get("length"),
        width=sizes.get("width"),
        angle_deg=sizes.get("angle_deg"),
    )
