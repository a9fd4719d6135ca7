"""Compensate an element of ball centres for the ball, and check the touched side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, assert_never

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.shapes import GEOMETRY_SIZE, HALF_ANGLE, RADIUS, Fit, NominalFeature
from ocmm_core.geometry import Float

if TYPE_CHECKING:
    from ocmm_core.features.measured._actual import Touches

ALONG = 0.1
"""Part of the approach square to a line below which it does not show the side of the material."""


@dataclass(frozen=True, slots=True)
class Compensation:
    """Compensated geometry (12,), derivatives by raw geometry (12, 12) and ball (12,)."""

    geometry: Float
    by_raw: Float
    by_radius: Float


def compensation(
    nominal: NominalFeature, raw: Fit, touches: Touches, normals: Float, sign: float
) -> Compensation:
    """Return the surface element of a fit of ball centres.

    Parameters
    ----------
    normals
        (n, 3): of the element at the ball centres, towards greater distances.
    sign
        1.0 for a probe outside the curve of the material, -1.0 inside.

    Raises
    ------
    FitError
        A point was approached from the wrong side, or the feature is smaller than the ball.
    """
    geometry = raw.geometry.copy()
    by_raw = np.eye(GEOMETRY_SIZE)
    by_radius = np.zeros(GEOMETRY_SIZE)
    radius = touches.tip_radius
    spec = nominal.shape.spec
    if spec.is_curved:
        _check_sides(nominal, touches, sign * np.sum(touches.directions * normals, axis=1))
    match spec.ball:
        case "approach":
            by_radius[0:3] = -touches.directions.mean(axis=0)
        case "normal":
            _check_sides(nominal, touches, touches.directions @ raw.direction)
            by_radius[0:3] = -raw.direction
            by_raw[0:3, 3:6] = -radius * np.eye(3)
        case "beside":
            towards, by_direction = _beside_line(nominal, raw, touches)
            _check_sides(nominal, touches, touches.directions @ towards)
            by_radius[0:3] = -towards
            by_raw[0:3, 3:6] = -radius * by_direction
        case "slanted":
            # The cone of the ball centres is shifted square to its surface, not to its axis.
            by_radius[RADIUS] = -sign / np.cos(raw.half_angle)
            by_raw[RADIUS, HALF_ANGLE] = radius * by_radius[RADIUS] * np.tan(raw.half_angle)
        case "sizes":
            for size in spec.sizes:
                by_radius[size.place] = -sign if size.grows else 0.0
        case "kept":
            pass
        case _:
            assert_never(spec.ball)
    geometry += radius * by_radius
    sizes = [size.whole(geometry) for size in spec.sizes if not size.is_angle]
    if sizes and min(sizes) <= 0.0:
        word = "width" if spec.has_sides else "diameter"
        raise FitError(
            "feature.smaller_than_ball",
            f"{nominal.name} would have a {word} of {min(sizes):.3f} mm after ball compensation.",
            "Check the probe side in the plan and the stylus in use.",
        )
    return Compensation(geometry, by_raw, by_radius)


def _beside_line(nominal: NominalFeature, raw: Fit, touches: Touches) -> tuple[Float, Float]:
    """Return the unit vector (3,) from edge to probe, square to the line, and its derivative."""
    mean = touches.directions.mean(axis=0)
    along = float(mean @ raw.direction)
    beside = mean - along * raw.direction
    length = float(np.linalg.norm(beside))
    if length < ALONG:
        raise FitError(
            "feature.no_side",
            f"The points of {nominal.name} were approached along the line, or from all sides.",
            "Approach a line from one side, square to it.",
        )
    towards = beside / length
    turned = -along * np.eye(3) - np.outer(raw.direction, mean)
    by_direction: Float = (np.eye(3) - np.outer(towards, towards)) @ turned / length
    return towards, by_direction


def _check_sides(nominal: NominalFeature, touches: Touches, approach: Float) -> None:
    """Raise FitError if a point was approached from the wrong side."""
    wrong = np.flatnonzero(~(approach > 0.0))
    if not wrong.size:
        return
    listed = ", ".join(str(touches.numbers[i]) for i in wrong[:5])
    listed += " and more" if wrong.size > 5 else ""
    where = "the other points were taken on the other face"
    if nominal.shape.spec.is_curved:
        where = f"the plan says {nominal.side!r}"
    raise FitError(
        "feature.wrong_side",
        f"Point{'s' if wrong.size > 1 else ''} {listed} of {nominal.name} "
        f"{'were' if wrong.size > 1 else 'was'} approached from the wrong side: {where}.",
        "Flip that point or take it again; a wrong side gives an error of a whole ball diameter.",
    )
