"""Planes and round surfaces stored as splines; needs OCP.

The library recognises them; the result is checked on places and edges of the face, and used only
within `RECOGNISED_MM`.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._elementary import elementary_face
from ocmm_cad.step.brep._library import kind_of, vector
from ocmm_cad.step.brep._step_face import StepFace, normals_of, offsets_of
from ocmm_core.geometry import Float

RECOGNISED_MM = 0.005
"""A face that leaves its plane, cylinder, cone or sphere by more stays a free form: well below the
uncertainty of a touch, far above the rounding of exporters."""
_KINDS = frozenset(
    ("BSplineSurface", "BezierSurface", "SurfaceOfRevolution", "SurfaceOfExtrusion",
     "OffsetSurface", "OtherSurface")
)  # fmt: skip
_SHAPES = ("Plane", "Cylinder", "Cone", "Sphere")
_CLASSES = ("Plane", "CylindricalSurface", "ConicalSurface", "SphericalSurface")
_GRIDS = (20, 60)
_ENOUGH = 60


def recognised_face(
    face: Any, surface: Any, reverse: bool, uv: Float, starts: NDArray[np.int64]
) -> tuple[StepFace, Float, Float, Float, Float] | None:
    """Return the surface of a spline, places inside its edges, and its edges; None if free form.

    ``surface``: `BRepAdaptor_Surface` of the face; ``uv``, ``starts``: edges as in
    `kernel.run_along`. Returns the surface, with ``deviation_mm``; places (n, 3), mm, on it; edges
    (len(uv), 3), mm, on the spline; their normals and lengths, as in `kernel.run_along`.
    """
    if kind_of(surface) not in _KINDS:
        return None
    found = _found_by_library(face)
    if found is None:
        return None
    word, canonical = found
    lines = _values(surface, uv)
    places = _places_inside(surface, uv, starts)
    if not len(places) or not np.isfinite(lines).all():
        return None
    samples = np.concatenate([lines, places])
    said = _as_face(word, canonical, samples)
    if said is None:
        return None
    # The side of the material follows from the spline, not from the recognised surface.
    middle = starts[:-1] + (np.diff(starts) // 2)
    truth = _normals(surface, uv[middle], reverse)
    same = normals_of(said, lines[middle])
    if float(np.nan_to_num(truth * same).sum()) < 0.0:
        said = _turned(said)
    deviation = float(np.abs(offsets_of(said, samples)).max())
    if deviation > RECOGNISED_MM:
        return None
    onto = places - offsets_of(said, places)[:, None] * normals_of(said, places)
    steps = np.linalg.norm(np.diff(lines, axis=0), axis=1)
    lengths = np.array([steps[first : last - 1].sum() for first, last in pairwise(starts.tolist())])
    made = msgspec.structs.replace(said, deviation_mm=deviation)
    return made, onto, lines, truth, lengths


def _found_by_library(face: Any) -> tuple[str, Any] | None:
    """Return word and surface recognised by the library; None for a free form."""
    import OCP.Geom as Geom
    import OCP.gp as gp
    from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

    asked = ShapeAnalysis_CanonicalRecognition(face)
    for word, owner in zip(_SHAPES, _CLASSES, strict=True):
        filled = getattr(gp, f"gp_{'Pln' if word == 'Plane' else word}")()
        if getattr(asked, f"Is{word}")(RECOGNISED_MM, filled):
            return word, getattr(Geom, f"Geom_{owner}")(filled)
    return None


def _as_face(word: str, canonical: Any, samples: Float) -> StepFace | None:
    from OCP.GeomAdaptor import GeomAdaptor_Surface

    frame = canonical.Position()
    arms = samples - vector(frame.Location())
    u, v = arms @ vector(frame.XDirection()), arms @ vector(frame.YDirection())
    height = arms @ vector(frame.Direction())
    if word == "Plane":
        bounds = (u.min(), u.max(), v.min(), v.max())
    elif word == "Sphere":
        bounds = (0.0, 2.0 * np.pi, -0.5 * np.pi, 0.5 * np.pi)
    else:
        slant = np.cos(canonical.SemiAngle()) if word == "Cone" else 1.0
        bounds = (0.0, 2.0 * np.pi, height.min() / slant, height.max() / slant)
    if bounds[1] - bounds[0] <= 0.0 or bounds[3] - bounds[2] <= 0.0:
        return None
    return elementary_face(GeomAdaptor_Surface(canonical, *map(float, bounds)), False)


def _turned(face: StepFace) -> StepFace:
    if face.shape != "Plane":
        return msgspec.structs.replace(face, inner=not face.inner)
    x, y, z = face.direction
    return msgspec.structs.replace(face, direction=(-x, -y, -z))


def _places_inside(surface: Any, uv: Float, starts: NDArray[np.int64]) -> Float:
    """Return places of a spline inside its edges (n, 3), mm: refined if there are few."""
    if not len(uv):
        return np.empty((0, 3))
    loops = kernel.closed_loops(uv, starts)
    (u0, v0), (u1, v1) = uv.min(axis=0), uv.max(axis=0)
    inside = np.empty((0, 2))
    for count in _GRIDS:
        us = u0 + (u1 - u0) * (np.arange(count) + 0.5) / count
        vs = v0 + (v1 - v0) * (np.arange(count) + 0.5) / count
        found = np.zeros((count, count), dtype=np.bool_)
        kernel.inside(us, vs, loops, found)
        rows, columns = np.nonzero(found)
        inside = np.column_stack([us[rows], vs[columns]])
        if len(inside) >= _ENOUGH:
            break
    return _values(surface, inside)


def _values(surface: Any, uv: Float) -> Float:
    points = (surface.Value(u, v) for u, v in uv.tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in points]).reshape(-1, 3)


def _normals(surface: Any, uv: Float, reverse: bool) -> Float:
    """Return the normals out of the material (n, 3); zero where undefined."""
    from OCP.gp import gp_Pnt, gp_Vec

    found = np.zeros((len(uv), 3))
    for row, (u, v) in enumerate(uv.tolist()):
        point, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
        surface.D1(u, v, point, by_u, by_v)
        crossed = by_u.Crossed(by_v)
        if crossed.Magnitude() > 0.0:
            found[row] = vector(crossed) / crossed.Magnitude()
    return -found if reverse else found
