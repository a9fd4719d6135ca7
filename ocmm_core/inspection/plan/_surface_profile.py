"""From faces of the model to what a plan needs for their profile: points, and the demand."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.part_model import ModelFace, nominal_face, searched, spread_places
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
        for place, normal in zip(places.tolist(), normals.tolist(), strict=True):
            features.append(
                NominalFeature(
                    name=f"{name} {len(features) + 1}",
                    shape=Shape.POINT,
                    points=1,
                    point=(place[0], place[1], place[2]),
                    direction=(normal[0], normal[1], normal[2]),
                )
            )
    if len(features) < LEAST_PLACES:
        numbers = ", ".join(str(face.number) for face in faces)
        raise InputError(
            "plan.no_room",
            f"Only {len(features)} places of face {numbers} have room for a ball of "
            f"{2.0 * ball_radius:g} mm; {LEAST_PLACES} are needed.",
            "Plan a smaller ball or more points, or name more faces.",
        )
    item = Characteristic(
        name=name, kind="surface profile", features=[item.name for item in features],
        datums=list(datums), upper=tolerance, faces=held,
    )  # fmt: skip
    return features, item
