"""From faces of the model to their profile: points and characteristic."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from ocmm_core.alignment import DatumReferenceFrame, ModelBestFit
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import EDITED, Plan, check_plan
from ocmm_core.part_model import (
    ModelFace,
    NominalFace,
    nearest_feet,
    nominal_face,
    searched,
    spread_places,
)
from ocmm_core.tolerances.zones import Characteristic

if TYPE_CHECKING:
    from ocmm_cad.step import FreeForm

CLEAR_MM = 1.0
"""mm, in addition to the ball radius: least distance of a place from every edge."""
LEAST_PLACES = 7
"""Fewer prove nothing about a surface that may follow its points."""
USUAL_PLACES, USUAL_BALL_RADIUS = 24, 3.0
"""Points of a best fit to faces, and ball radius of the standard probe, mm."""
_ON_MM = 0.05
"""mm: distance up to which a point lies on a face."""
_LONGEST = 40


def with_profiles(plan: Plan, free_forms: Sequence[FreeForm], tolerance: float) -> Plan:
    """Return a plan with free-form faces of its model: their points, and a profile of each.

    In the datum system of the plan's alignment. A plan without one gets the best fit to these
    faces, and each profile is best-fitted: without datums it does not locate a face. ``tolerance``,
    mm: width of their zones. InputError if a name is taken, or the tolerance is invalid.
    """
    if not free_forms:
        return plan
    rule = plan.alignment
    datums = rule.datums if isinstance(rule, DatumReferenceFrame) else ()
    features: list[NominalFeature] = []
    items: list[Characteristic] = []
    for one in free_forms:
        points = _points(one.name, one.targets, one.normals)
        features += points
        items.append(_profile(one.name, points, (one.face,), tolerance, datums))
    if rule is None:
        rule = ModelBestFit(
            points=tuple(point.name for point in features),
            faces=tuple(one.face for one in free_forms),
        )
    more = msgspec.structs.replace(
        plan, features=[*plan.features, *features], alignment=rule,
        characteristics=[*plan.characteristics, *items],
    )  # fmt: skip
    check_plan(EDITED, more)
    return more


def with_model_fit(
    plan: Plan,
    faces: Sequence[ModelFace],
    *,
    count: int = USUAL_PLACES,
    ball_radius: float = USUAL_BALL_RADIUS,
) -> Plan:
    """Return a plan whose alignment is the best fit to faces of its model.

    Existing single points on the faces are used; a face with fewer than its share of ``count`` gets
    more, named after it. ``ball_radius``, mm: of the largest ball. InputError if no face is given,
    the model has no surface of one, or too few places have room for the ball.
    """
    if not faces:
        raise InputError(
            "plan.no_faces", "No face of the model is chosen.", "Choose the faces to align by."
        )
    held = tuple(nominal_face(face) for face in faces)
    singles = [one for one in plan.features if one.shape is Shape.POINT]
    on_faces = _lying_on(singles, held)
    taken = {item.name for item in (*plan.features, *plan.constructions, *plan.characteristics)}
    points = [one.name for one, place in zip(singles, on_faces, strict=True) if place >= 0]
    added: list[NominalFeature] = []
    for place, (face, one) in enumerate(zip(faces, held, strict=True)):
        wanted = count // len(held) + (place < count % len(held)) - on_faces.count(place)
        if wanted <= 0:
            continue
        spread = spread_places(searched(one), wanted, ball_radius + CLEAR_MM, ball_radius)
        stem = face.name or face.feature or f"FACE {face.number}"
        places, normals = (rows.tolist() for rows in spread)
        made = _points(f"{_named(stem, taken)} on", places, normals)
        taken.update(item.name for item in made)
        added += made
    points += [item.name for item in added]
    if len(points) < LEAST_PLACES:
        numbers = ", ".join(str(face.number) for face in faces)
        raise _no_room(len(points), numbers, ball_radius)
    rule = ModelBestFit(points=tuple(points), faces=held)
    more = msgspec.structs.replace(plan, features=[*plan.features, *added], alignment=rule)
    check_plan(EDITED, more)
    return more


def _lying_on(points: Sequence[NominalFeature], faces: Sequence[NominalFace]) -> list[int]:
    """Return the index of the face that each point lies on; -1 for none."""
    if not points:
        return []
    feet = nearest_feet(np.array([one.point for one in points]), [searched(one) for one in faces])
    near = np.abs(feet.distances) <= _ON_MM
    return [int(face) if on else -1 for face, on in zip(feet.faces, near, strict=True)]


def _named(stem: str, taken: Collection[str]) -> str:
    words = "".join(sign if sign.isalnum() or sign in " _.-" else " " for sign in stem).strip()
    stem = words[:_LONGEST] or "FACE"
    every = (stem, *(f"{stem} {number}" for number in range(2, len(taken) + 3)))
    return next(one for one in every if not any(it.startswith(f"{one} on ") for it in taken))


def _no_room(count: int, numbers: str, ball_radius: float) -> InputError:
    return InputError(
        "plan.no_room",
        f"Only {count} places of face {numbers} have room for a ball of "
        f"{2.0 * ball_radius:g} mm; {LEAST_PLACES} are needed.",
        "Plan a smaller ball or more points, or name more faces.",
    )


def _points(
    name: str, places: Sequence[Sequence[float]], normals: Sequence[Sequence[float]]
) -> list[NominalFeature]:
    return [
        NominalFeature(
            name=f"{name} {number}",
            shape=Shape.POINT,
            points=1,
            point=(place[0], place[1], place[2]),
            direction=(normal[0], normal[1], normal[2]),
        )
        for number, (place, normal) in enumerate(zip(places, normals, strict=True), 1)
    ]


def _profile(
    name: str,
    points: Sequence[NominalFeature],
    faces: tuple[NominalFace, ...],
    tolerance: float,
    datums: Sequence[str],
) -> Characteristic:
    return Characteristic(
        name=name, kind="surface profile", features=[item.name for item in points],
        datums=list(datums), upper=tolerance, faces=faces,
    )  # fmt: skip
