"""From faces of the model to what a plan needs for their profile: points, and the demand."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_core.alignment import DatumReferenceFrame, ModelBestFit
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan._edit import EDITED
from ocmm_core.inspection.plan._plan import Plan, check_plan
from ocmm_core.inspection.step import FreeForm
from ocmm_core.part_model import ModelFace, NominalFace, nominal_face, searched, spread_places
from ocmm_core.tolerances.zones import Characteristic

CLEAR_MM = 1.0
"""Beside the radius of the ball: least distance of a place from every edge."""
LEAST_PLACES = 7
"""Fewer say nothing of a surface that may follow its points."""


def surface_profile(
    name: str,
    faces: Sequence[ModelFace],
    tolerance: float,
    *,
    count: int,
    datums: Sequence[str] = (),
    ball_radius: float = 3.0,
) -> tuple[list[NominalFeature], Characteristic]:
    """Return single points spread over faces of the model, and their profile against these faces.

    Parameters
    ----------
    name
        Of the characteristic; the points are called ``NAME 1`` and so on.
    tolerance
        mm: width of the zone.
    count
        Points in all, shared by the faces.
    ball_radius
        mm: of the largest ball that is to fit.

    Raises
    ------
    InputError
        The model holds no surface of a face, or too few places of the faces have room for the ball.
    """
    held = tuple(nominal_face(face) for face in faces)
    shares = [count // len(held) + (i < count % len(held)) for i in range(len(held))]
    features: list[NominalFeature] = []
    for face, share in zip(held, shares, strict=True):
        places, normals = spread_places(searched(face), share, ball_radius + CLEAR_MM, ball_radius)
        features += _points(name, places.tolist(), normals.tolist(), len(features))
    if len(features) < LEAST_PLACES:
        numbers = ", ".join(str(face.number) for face in faces)
        raise InputError(
            "plan.no_room",
            f"Only {len(features)} places of face {numbers} have room for a ball of "
            f"{2.0 * ball_radius:g} mm; {LEAST_PLACES} are needed.",
            "Plan a smaller ball or more points, or name more faces.",
        )
    return features, _profile(name, features, held, tolerance, datums)


def with_profiles(plan: Plan, free_forms: Sequence[FreeForm], tolerance: float) -> Plan:
    """Return a plan with free-form faces of its model: their points, and a profile of each.

    The profiles are in the datum system that is the plan's alignment. A plan without an alignment
    gets the best fit to these faces, and each profile is where it fits best: without datums it
    says nothing of where a face lies.

    Parameters
    ----------
    tolerance
        mm: width of their zones.

    Raises
    ------
    InputError
        A name is taken, or the tolerance is none.
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


def _points(
    name: str,
    places: Sequence[Sequence[float]],
    normals: Sequence[Sequence[float]],
    before: int = 0,
) -> list[NominalFeature]:
    return [
        NominalFeature(
            name=f"{name} {number}",
            shape=Shape.POINT,
            points=1,
            point=(place[0], place[1], place[2]),
            direction=(normal[0], normal[1], normal[2]),
        )
        for number, (place, normal) in enumerate(zip(places, normals, strict=True), before + 1)
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
