"""Face of the model as a plan holds it: exact, independent of the model file.

So results depend neither on later changes of the model nor on a CAD library.

Touch points on it are far from its edges and from each other, where the ball fits.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import islice

import msgspec
import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model._nearest import RIVAL_MM, SearchedFace, nearest_feet, searched_face
from ocmm_core.part_model._part_model import ModelFace, SplineSurface
from ocmm_core.part_model._spline import curvatures_at, normals_at, places_at

MOST_NUMBERS = 200_000
"""Maximum numbers of a face in a plan: some 3 MB of text."""
MOST_DEGREE = 25
"""Highest degree in written models."""


class NominalFace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One trimmed face; lengths in mm, frame of the nominals."""

    number: int
    """Number of the face in the model, from 1."""
    degree_u: int
    degree_v: int
    knots_u: tuple[float, ...]
    knots_v: tuple[float, ...]
    """Of the rational B-spline; knots with repetitions."""
    poles: tuple[float, ...]
    """x, y, z and weight of each pole, those along v first."""
    loops: tuple[tuple[float, ...], ...] = ()
    """Outline and holes, each u, v of its corners; empty: the whole surface."""
    outward: bool = True
    """The normal du x dv leaves the material."""


def nominal_face(face: ModelFace) -> NominalFace:
    """Return a face as a plan holds it; InputError without a surface, or if too large."""
    if face.spline is None:
        raise InputError(
            "model.no_surface",
            f"The model holds no surface of face {face.number}.",
            "Choose another face, or export the model with surfaces.",
        )
    spline = face.spline
    poles = np.concatenate([spline.poles, spline.weights[..., None]], axis=-1)
    made = NominalFace(
        number=face.number,
        degree_u=spline.degree_u,
        degree_v=spline.degree_v,
        knots_u=tuple(spline.knots_u.tolist()),
        knots_v=tuple(spline.knots_v.tolist()),
        poles=tuple(poles.ravel().tolist()),
        loops=tuple(tuple(loop.ravel().tolist()) for loop in face.loops),
        outward=face.outward,
    )
    fault = face_fault(made)
    if fault is not None:
        raise InputError(
            "model.face",
            f"Face {face.number} of the model cannot be part of a plan: {fault}.",
            "Choose another face.",
        )
    return made


def face_fault(face: NominalFace) -> str | None:
    count = len(face.poles) + len(face.knots_u) + len(face.knots_v)
    count += sum(len(loop) for loop in face.loops)
    if count > MOST_NUMBERS:
        return f"it has {count} numbers, at most {MOST_NUMBERS} are taken"
    if not (1 <= face.degree_u <= MOST_DEGREE and 1 <= face.degree_v <= MOST_DEGREE):
        return f"a degree is not 1 to {MOST_DEGREE}"
    nu, nv = len(face.knots_u) - face.degree_u - 1, len(face.knots_v) - face.degree_v - 1
    if nu < 2 or nv < 2 or len(face.poles) != 4 * nu * nv:
        return "poles, knots and degrees do not belong together"
    if any(len(loop) < 6 or len(loop) % 2 for loop in face.loops):
        return "a loop has fewer than three corners, or half of one"
    if not all(np.all(np.isfinite(loop)) for loop in face.loops):
        return "a corner of a loop is not finite"
    try:
        made = searched(face)
    except InputError as error:
        return error.what
    return None if len(made.patches.low) else "nothing of its surface is inside its outline"


@lru_cache(maxsize=64)
def searched(face: NominalFace) -> SearchedFace:
    """Return a face prepared for `nearest_feet`, cached; InputError if no rational B-spline."""
    return searched_face(model_face(face))


def model_face(face: NominalFace) -> ModelFace:
    nu, nv = len(face.knots_u) - face.degree_u - 1, len(face.knots_v) - face.degree_v - 1
    poles = np.array(face.poles, dtype=np.float64).reshape(nu, nv, 4)
    spline = SplineSurface(
        poles[..., :3].copy(), poles[..., 3].copy(), np.array(face.knots_u),
        np.array(face.knots_v), face.degree_u, face.degree_v,
    )  # fmt: skip
    loops = tuple(np.array(loop, dtype=np.float64).reshape(-1, 2) for loop in face.loops)
    return ModelFace(
        face.number, "BSplineSurface", spline=spline, outward=face.outward, loops=loops
    )


_GRID = 48
_FIT = 0.8
"""A hollow is touched where the ball is at most this part of its radius."""


def spread_places(
    face: SearchedFace, count: int, clear_mm: float, ball_radius: float
) -> tuple[Float, Float]:
    """Return places (k, 3), mm, on a face and its outward normals; k is at most ``count``.

    Each is as far as possible from the previous ones, the first one from the edges. `clear_mm`:
    minimum distance from every edge. `ball_radius`: mm: a ball there touches this place alone.
    """
    surface = face.surface
    steps = (np.arange(_GRID) + 0.5) / _GRID
    u, v = np.meshgrid(steps, steps, indexing="ij")
    at = surface.low + np.stack([u.ravel(), v.ravel()], axis=1) * (surface.high - surface.low)
    at = at[face.trimming.holds(at)]
    places = places_at(surface, at)
    gaps = face.trimming.nearest_edge(places)[0]
    normals = normals_at(surface, at) * (1.0 if face.outward else -1.0)
    hollow = np.maximum(-curvatures_at(surface, at, normals).min(axis=1, initial=0.0), 0.0)
    fits = (gaps >= clear_mm) & (hollow * ball_radius <= _FIT)
    places, normals, gaps = places[fits], normals[fits], gaps[fits]
    chosen: list[int] = []
    order = _order(places, gaps)
    # The order does not depend on refused places: many are evaluated at once.
    while len(chosen) < count and (asked := list(islice(order, count))):
        feet = nearest_feet(places[asked] + ball_radius * normals[asked], [face])
        for row, doubt, distance in zip(asked, feet.doubts, feet.distances, strict=True):
            # A ball here may touch another fold of the face first.
            if doubt == "" and abs(distance - ball_radius) < 0.1 * RIVAL_MM:
                chosen.append(row)
    return places[chosen[:count]], normals[chosen[:count]]


def _order(places: Float, gaps: Float) -> Iterator[int]:
    """Yield all places, each as far as possible from edges and from the previous ones."""
    apart = np.minimum(gaps, 1e6)
    while len(places) and float(apart.max()) > 0.0:
        best = int(np.argmax(apart))
        apart = np.minimum(apart, np.linalg.norm(places - places[best], axis=1))
        apart[best] = 0.0
        yield best
