"""Registry of elements: fits and distances of each shape; KeyError for a shape without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from ocmm_core.features import search
from ocmm_core.features.elements import _distances as distances
from ocmm_core.features.elements._cone import fit_cone
from ocmm_core.features.elements._cylinder import fit_cylinder
from ocmm_core.features.elements._ellipse import fit_ellipse, fit_ellipse_projected
from ocmm_core.features.elements._flat import fit_circle, fit_circle_free, fit_circle_projected
from ocmm_core.features.elements._plane import fit_line, fit_plane, fit_point, fit_sphere
from ocmm_core.features.elements._slot import fit_slot, fit_slot_projected
from ocmm_core.features.elements._torus import fit_torus
from ocmm_core.features.shapes import GEOMETRY_SIZE, POINT, Fit, Shape
from ocmm_core.geometry import Float, Points3


class FitPrior(NamedTuple):
    """Prior information for a fit. A named tuple, as one is made for every fit."""

    direction: Float | None = None
    """(3,): the result points along it."""
    radius: float | None = None
    second: float | None = None
    half_angle: float | None = None
    """`radius`, `second`, `half_angle`: mm, mm, rad: may decide between rivals."""
    free: bool = False
    """Circle only: in space as one problem."""
    offset: float = 0.0
    """mm: distance of the element from its points, for shapes with ball ``kept``."""

    @property
    def sizes(self) -> tuple[float, float] | None:
        """Return both sizes, or None if one is missing."""
        return None if self.radius is None or self.second is None else (self.radius, self.second)


Slopes: TypeAlias = Callable[[Fit, Float, Float], Points3]
"""From a fit and arms (n, 3) from its point: writes d(distance) / d(geometry), returns normals."""
Signed: TypeAlias = Callable[[Float, Float], tuple[Float, Points3]]
"""From a geometry vector (12,) and arms (n, 3) from its point to distances and normals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSpec:
    """Computation for one shape."""

    fit: Callable[[Points3, FitPrior], Fit]
    """Least squares, from points (n, 3), mm."""
    projected: Callable[[Points3, Float, FitPrior], tuple[Fit, Float]] | None
    """The same in a plane of a normal (3,), with its derivatives (12, 3); None without a plane."""
    jacobian: Slopes
    """Derivatives of signed distances, see `distance_derivatives`."""
    signed: Signed
    """Signed distances from a nominal, see `nominal_distances`."""
    kernel: int | None
    """Kind of the compiled solver that tracks a minimum; None: the element is refitted."""
    may_be_turned: bool
    """`fit_oriented` supports a given direction."""


def _slot(shape: Shape, jacobian: Slopes, signed: Signed, kernel: int) -> ElementSpec:
    return ElementSpec(
        fit=lambda points, known: fit_slot(shape, points, known.direction, known.sizes),
        projected=lambda points, normal, known: fit_slot_projected(
            shape, points, normal, known.sizes
        ),
        jacobian=jacobian, signed=signed, kernel=kernel, may_be_turned=False,
    )  # fmt: skip


ELEMENTS = {
    Shape.POINT: ElementSpec(
        fit=lambda points, known: fit_point(points),
        projected=None,
        jacobian=distances.point_jacobian,
        signed=distances.signed_plane,
        kernel=None,
        may_be_turned=False,
    ),
    Shape.LINE: ElementSpec(
        fit=lambda points, known: fit_line(points, known.direction),
        projected=None,
        jacobian=distances.line_slopes,
        signed=distances.signed_plane,
        kernel=None,
        may_be_turned=True,
    ),
    Shape.PLANE: ElementSpec(
        fit=lambda points, known: fit_plane(points, known.direction),
        projected=None,
        jacobian=distances.plane_slopes,
        signed=distances.signed_plane,
        kernel=None,
        may_be_turned=True,
    ),
    Shape.CIRCLE: ElementSpec(
        fit=lambda points, known: (fit_circle_free if known.free else fit_circle)(
            points, known.direction
        ),
        projected=lambda points, normal, known: fit_circle_projected(points, normal),
        jacobian=distances.circle_slopes,
        signed=distances.signed_cylinder,
        kernel=search.DISC,
        may_be_turned=True,
    ),
    Shape.SPHERE: ElementSpec(
        fit=lambda points, known: fit_sphere(points),
        projected=None,
        jacobian=distances.sphere_slopes,
        signed=distances.signed_sphere,
        kernel=search.BALL,
        may_be_turned=False,
    ),
    Shape.CYLINDER: ElementSpec(
        fit=lambda points, known: fit_cylinder(points, known.direction, known.radius),
        projected=None,
        jacobian=distances.cylinder_jacobian,
        signed=distances.signed_cylinder,
        kernel=search.CYLINDER,
        may_be_turned=True,
    ),
    Shape.ELLIPSE: ElementSpec(
        fit=lambda points, known: fit_ellipse(points, known.direction, known.offset),
        projected=lambda points, normal, known: fit_ellipse_projected(points, normal, known.offset),
        jacobian=distances.ellipse_slopes,
        signed=distances.signed_ellipse,
        kernel=search.ELLIPSE,
        may_be_turned=False,
    ),
    Shape.ROUND_SLOT: _slot(
        Shape.ROUND_SLOT, distances.round_slopes, distances.signed_round_slot, search.ROUND_ENDS
    ),
    **{
        shape: _slot(
            shape, distances.square_jacobian, distances.signed_rectangle, search.SQUARE_ENDS
        )
        for shape in (Shape.SQUARE_SLOT, Shape.RECTANGLE)
    },
    Shape.CONE: ElementSpec(
        fit=lambda points, known: fit_cone(points, known.half_angle),
        projected=None,
        jacobian=distances.cone_slopes,
        signed=distances.signed_cone,
        kernel=search.CONE,
        may_be_turned=True,
    ),
    Shape.TORUS: ElementSpec(
        fit=lambda points, known: fit_torus(points, known.direction, known.sizes),
        projected=None,
        jacobian=distances.torus_slopes,
        signed=distances.signed_torus,
        kernel=search.TORUS,
        may_be_turned=True,
    ),
}


def distance_derivatives(fit: Fit, points: Points3) -> tuple[Float, Float]:
    """Return the first-order derivatives of the signed distances of points.

    ``points`` (n, 3), mm, are the fitted ones, as the side of a line comes from their residuals.
    ``by_geometry`` (n, 12) is d(distance) / d(geometry); ``by_point`` (n, 3) is d(distance) / d(the
    point itself): the normal of the element towards the point.
    """
    by_geometry = np.zeros((len(points), GEOMETRY_SIZE))
    normals = ELEMENTS[fit.shape].jacobian(fit, points - fit.point, by_geometry)
    by_geometry[:, POINT] = -normals
    return by_geometry, normals


def surface_normals(fit: Fit, points: Points3) -> Points3:
    """Return the outward normals (n, 3) of an element's surface; of a circle in its plane."""
    return distance_derivatives(replace(fit, free=False), points)[1]


def nominal_distances(shape: Shape, geometry: Float, points: Points3) -> tuple[Float, Points3]:
    """Return the signed distance of every point from an element, and its normal there.

    Circle, ellipse, slots and rectangle are seen along their normal: a line in their plane, at any
    height. A rectangle has no corners: each point belongs to its nearest side. Points and lines
    count as planes: ``geometry`` (12,) must have the normal of their face as direction.

    ``points`` are (n, 3), mm, in the frame of ``geometry``. Distances (n,), mm, are positive
    outside of round shapes, and on the normal's side of a plane; normals (n, 3), unit, point to
    growing distance.
    """
    return ELEMENTS[shape].signed(geometry, points - geometry[POINT])
