"""Check the consistency of a model, on which drawing and measuring rely."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model._part_model import ModelFace, PartModel, SplineSurface

MOST_TRIANGLES = 400_000
MOST_FACES = 50_000
_MOST_DEGREE = 25
"""Limit of the kernels of CAD systems."""
FARTHEST_MM = 1e6
"""Largest coordinate of a part."""
_LONGEST_NAME = 255
_COLOUR = re.compile(r"(#[0-9a-f]{6})?")
_HASH = re.compile(r"[0-9a-f]{64}")
_NO_NAME = re.compile(r"[\x00-\x1f\x7f/\\]")
_ROUNDING = 1e-6
_OUTSIDE = 1e-3
"""Part of the range of parameters by which an outline may leave it."""


def check_model(model: PartModel, where: str) -> None:
    """Raise InputError, which names ``where``, for an inconsistent model."""
    why = _why_not(model)
    if why:
        raise InputError(
            "part_model.damaged",
            f"{where}: the part in it cannot be used: {why}.",
            "Import the CAD model again, or restore the file from a good copy.",
        )


def _why_not(model: PartModel) -> str:
    name = model.source_name
    if not name or len(name) > _LONGEST_NAME or _NO_NAME.search(name):
        return "the name of its source is none"
    if not _HASH.fullmatch(model.source_sha256):
        return "the hash of its source is none"
    if not 0.0 < model.deflection_mm < FARTHEST_MM:
        return "its deflection is no size"
    if not 0 < len(model.faces) <= MOST_FACES:
        return f"it has {len(model.faces)} faces, and can have 1 to {MOST_FACES}"
    if not 0 < len(model.triangles) <= MOST_TRIANGLES:
        return f"it has {len(model.triangles)} triangles, and can have 1 to {MOST_TRIANGLES}"
    why = _why_no_mesh(model) or _why_no_edges(model)
    if why:
        return why
    for face in model.faces:
        why = _why_no_face(face)
        if why:
            return f"face {face.number}: {why}"
    return ""


def _why_no_mesh(model: PartModel) -> str:
    count = len(model.vertices)
    if model.vertices.shape != (count, 3) or not _are_places(model.vertices):
        return "a vertex lies nowhere"
    if model.normals.shape != (count, 3):
        return "not every vertex has a normal"
    with np.errstate(over="ignore", invalid="ignore"):
        if not (np.abs(np.linalg.norm(model.normals, axis=1) - 1.0) < 1e-3).all():
            return "a normal has no direction"
    if model.triangles.shape != (len(model.triangles), 3) or not _within(
        model.triangles, 0, count - 1
    ):
        return "a triangle has no such vertex"
    if model.triangle_faces.shape != (len(model.triangles),) or not _within(
        model.triangle_faces, 0, len(model.faces) - 1
    ):
        return "a triangle has no such face"
    return ""


def _why_no_edges(model: PartModel) -> str:
    points, starts, sides = model.edge_points, model.edge_starts, model.edge_faces
    if points.shape != (len(points), 3) or not _are_places(points):
        return "an edge lies nowhere"
    if sides.shape != (len(sides), 2) or not _within(sides, -1, len(model.faces) - 1):
        return "an edge has no such face"
    if starts.shape != (len(sides) + 1,) or starts[0] != 0 or starts[-1] != len(points):
        return "its edges do not begin and end where they should"
    if not (np.diff(starts) >= 2).all():
        return "an edge has no two points"
    return ""


def _why_no_face(face: ModelFace) -> str:
    words = (face.kind, face.name, face.layer, face.feature)
    if face.number < 1 or not face.kind or any(len(word) > _LONGEST_NAME for word in words):
        return "its number, kind or name cannot be"
    if not _COLOUR.fullmatch(face.colour):
        return "its colour is none"
    if face.spline is None:
        return "it has an outline and no surface" if face.loops else ""
    why = _why_no_spline(face.spline)
    if why:
        return why
    low = np.array([face.spline.knots_u[0], face.spline.knots_v[0]])
    high = np.array([face.spline.knots_u[-1], face.spline.knots_v[-1]])
    spare = _OUTSIDE * (high - low) + 1e-9
    for loop in face.loops:
        if loop.ndim != 2 or loop.shape[1] != 2 or len(loop) < 3:
            return "an outline is no polygon"
        if not ((loop >= low - spare) & (loop <= high + spare)).all():
            return "an outline leaves its surface"
    return ""


def _why_no_spline(spline: SplineSurface) -> str:
    shape = spline.weights.shape
    if len(shape) != 2 or spline.poles.shape != (*shape, 3) or not _are_places(spline.poles):
        return "its surface lies nowhere"
    weights = spline.weights
    if not (np.isfinite(weights) & (weights > 1e-9) & (weights < 1e9)).all():
        return "a weight of its surface is not positive"
    for count, degree, knots in (
        (shape[0], spline.degree_u, spline.knots_u),
        (shape[1], spline.degree_v, spline.knots_v),
    ):
        if not 1 <= degree <= _MOST_DEGREE or count <= degree:
            return "its surface has no such degree"
        if knots.shape != (count + degree + 1,) or not _are_knots(knots, degree):
            return "the knots of its surface do not rise from end to end"
    return ""


def _are_knots(knots: Float, degree: int) -> bool:
    """Return whether knots rise, are clamped at both ends and keep the surface continuous."""
    if not np.isfinite(knots).all() or not (np.abs(knots) <= 1e15).all():
        return False
    length = knots[-1] - knots[0]
    if length <= 0.0 or (np.diff(knots) < 0.0).any():
        return False
    if (knots[: degree + 1] != knots[0]).any() or (knots[-degree - 1 :] != knots[-1]).any():
        return False
    # An inner knot is repeated at most ``degree`` times.
    inner = knots[1:-1]
    return len(inner) <= degree or bool((inner[degree:] > inner[:-degree]).all())


def _are_places(points: Float) -> bool:
    return bool((np.abs(points) <= FARTHEST_MM).all())


def _within(numbers: NDArray[Any], low: int, high: int) -> bool:
    return not numbers.size or bool(numbers.min() >= low and numbers.max() <= high)
