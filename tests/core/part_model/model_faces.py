"""Faces to measure against: made with numpy, and the same ones in the library of models."""

from __future__ import annotations

from typing import Any

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model import ModelFace, SplineSurface


def clamped(count: int, degree: int, rng: np.random.Generator | None = None) -> Float:
    """Return knots from 0 to 1 of ``count`` poles; uneven ones with a generator."""
    inner = np.arange(1, count - degree) / (count - degree)
    if rng is not None and len(inner):
        inner = inner + rng.uniform(-0.3, 0.3, len(inner)) / (count - degree)
    return np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])


def waves() -> SplineSurface:
    """Return a wavy sheet of 80 by 80 mm, bicubic."""
    x = np.linspace(-40.0, 40.0, 14)
    u, v = np.meshgrid(x, x, indexing="ij")
    poles = np.stack([u, v, 6.0 * np.sin(u / 11.0) * np.cos(v / 14.0)], axis=-1)
    knots = clamped(14, 3)
    return SplineSurface(poles, np.ones((14, 14)), knots, knots, 3, 3)


def rational() -> SplineSurface:
    """Return an uneven sheet with weights from 0.5 to 2 and two degrees."""
    rng = np.random.default_rng(4)
    x, y = np.linspace(0.0, 60.0, 9), np.linspace(0.0, 35.0, 7)
    u, v = np.meshgrid(x, y, indexing="ij")
    poles = np.stack([u, v, rng.uniform(-5.0, 5.0, u.shape)], axis=-1)
    weights = rng.uniform(0.5, 2.0, u.shape)
    return SplineSurface(poles, weights, clamped(9, 2, rng), clamped(7, 4, rng), 2, 4)


def blade() -> SplineSurface:
    """Return a twisted profile of 90 mm that bends back over itself, of degrees 5 and 3."""
    turn = np.linspace(0.0, 1.5 * np.pi, 12)
    height = np.linspace(0.0, 90.0, 8)
    t, z = np.meshgrid(turn, height, indexing="ij")
    twist = z / 120.0
    x, y = 22.0 * np.cos(t), 9.0 * np.sin(t)
    poles = np.stack(
        [x * np.cos(twist) - y * np.sin(twist), x * np.sin(twist) + y * np.cos(twist), z], axis=-1
    )
    return SplineSurface(poles, np.ones(t.shape), clamped(12, 5), clamped(8, 3), 5, 3)


FREE_FORMS = {"waves": waves, "rational": rational, "blade": blade}


def face_of(spline: SplineSurface, *, outward: bool = True, number: int = 1) -> ModelFace:
    """Return the face of a whole surface."""
    return ModelFace(number, "BSplineSurface", spline=spline, outward=outward)


def cylinder(radius: float = 10.0, height: float = 30.0) -> SplineSurface:
    """Return a whole cylinder about z, exactly: four quarters of a circle."""
    half = np.sqrt(0.5)
    x = radius * np.array([1, 1, 0, -1, -1, -1, 0, 1, 1.0])
    y = radius * np.array([0, 1, 1, 1, 0, -1, -1, -1, 0.0])
    poles = np.empty((9, 2, 3))
    poles[..., 0], poles[..., 1] = x[:, None], y[:, None]
    poles[..., 2] = [0.0, height]
    weights = np.tile(np.array([1, half, 1, half, 1, half, 1, half, 1])[:, None], (1, 2))
    knots = np.array([0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1])
    return SplineSurface(poles, weights, knots, np.array([0.0, 0, 1, 1]), 2, 1)


def plane(length: float = 50.0, width: float = 30.0) -> SplineSurface:
    """Return a rectangle from the origin along x and y, with its normal along z."""
    poles = np.zeros((2, 2, 3))
    poles[1, :, 0], poles[:, 1, 1] = length, width
    knots = np.array([0.0, 0.0, 1.0, 1.0])
    return SplineSurface(poles, np.ones((2, 2)), knots, knots, 1, 1)


# --- the same in the library ---------------------------------------------------------------------


def in_library(spline: SplineSurface) -> Any:
    """Return a surface of the library."""
    from OCP.collections import Array1_double, Array1_int, Array2_double, Array2_gp_Pnt
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    a, b = spline.weights.shape
    poles, weights = Array2_gp_Pnt(1, a, 1, b), Array2_double(1, a, 1, b)
    for i in range(a):
        for j in range(b):
            poles.SetValue(i + 1, j + 1, gp_Pnt(*spline.poles[i, j].tolist()))
            weights.SetValue(i + 1, j + 1, float(spline.weights[i, j]))
    arrays = []
    for knots in (spline.knots_u, spline.knots_v):
        values, counts = np.unique(knots, return_counts=True)
        own, times = Array1_double(1, len(values)), Array1_int(1, len(values))
        for i, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True)):
            own.SetValue(i + 1, value)
            times.SetValue(i + 1, count)
        arrays.append((own, times))
    (u, by_u), (v, by_v) = arrays
    return Geom_BSplineSurface(
        poles, weights, u, v, by_u, by_v, spline.degree_u, spline.degree_v
    )  # fmt: skip


def from_library(surface: Any) -> SplineSurface:
    """Return a B-spline of the library that is clamped."""
    a, b = surface.NbUPoles(), surface.NbVPoles()
    poles = np.empty((a, b, 3))
    weights = np.empty((a, b))
    for i in range(a):
        for j in range(b):
            pole = surface.Pole(i + 1, j + 1)
            poles[i, j] = pole.X(), pole.Y(), pole.Z()
            weights[i, j] = surface.Weight(i + 1, j + 1)
    u = [surface.UKnot(i) for i in range(1, surface.NbUKnots() + 1)]
    v = [surface.VKnot(i) for i in range(1, surface.NbVKnots() + 1)]
    by_u = [surface.UMultiplicity(i) for i in range(1, len(u) + 1)]
    by_v = [surface.VMultiplicity(i) for i in range(1, len(v) + 1)]
    return SplineSurface(
        poles, weights, np.repeat(u, by_u), np.repeat(v, by_v), surface.UDegree(), surface.VDegree()
    )


def whole_face(spline: SplineSurface) -> Any:
    """Return a face of the library that is a whole surface."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    return BRepBuilderAPI_MakeFace(in_library(spline), 1e-7).Face()


def analytic_faces() -> dict[str, tuple[SplineSurface, Any]]:
    """Return faces of other kinds as splines, with the face of the library they come from."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.Geom import (
        Geom_ConicalSurface,
        Geom_CylindricalSurface,
        Geom_Plane,
        Geom_RectangularTrimmedSurface,
        Geom_SphericalSurface,
        Geom_ToroidalSurface,
    )
    from OCP.GeomConvert import GeomConvert
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

    at = gp_Ax3(gp_Pnt(5.0, -3.0, 2.0), gp_Dir(1.0, 2.0, 2.0))
    turn = 2.0 * np.pi
    made = {
        "plane": (Geom_Plane(at), (-20.0, 25.0, -10.0, 15.0)),
        "cylinder": (Geom_CylindricalSurface(at, 8.0), (0.0, turn, -15.0, 15.0)),
        "cone": (Geom_ConicalSurface(at, 0.3, 12.0), (0.0, turn, -10.0, 20.0)),
        "sphere": (Geom_SphericalSurface(at, 15.0), (0.0, turn, -0.5 * np.pi, 0.5 * np.pi)),
        "torus": (Geom_ToroidalSurface(at, 20.0, 6.0), (0.0, turn, 0.0, turn)),
    }
    found = {}
    for name, (surface, bounds) in made.items():
        trimmed = Geom_RectangularTrimmedSurface(surface, *bounds, True, True)
        spline = GeomConvert.SurfaceToBSplineSurface_s(trimmed)
        for is_periodic, clamp in (
            (spline.IsUPeriodic(), spline.SetUNotPeriodic),
            (spline.IsVPeriodic(), spline.SetVNotPeriodic),
        ):
            if is_periodic:
                clamp()
        face = BRepBuilderAPI_MakeFace(trimmed, 1e-7).Face()
        found[name] = (from_library(spline), face)
    return found


def library_distances(points: Float, face: Any) -> Float:
    """Return the distances of points from a face by the library's own extrema, mm."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    return np.array(
        [
            BRepExtrema_DistShapeShape(
                BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex(), face
            ).Value()
            for point in points.tolist()
        ]
    )


def projected_distances(points: Float, surface: Any) -> Float:
    """Return the distances of points from a surface without edges by its projections, mm."""
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
    from OCP.gp import gp_Pnt

    return np.array(
        [
            GeomAPI_ProjectPointOnSurf(gp_Pnt(*point), surface).LowerDistance()
            for point in points.tolist()
        ]
    )
