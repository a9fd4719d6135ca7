"""The touched side of the material: four methods.

The direction of a point leads from the material to the probe. For surfaces it only tells the side
of the material, and the feature is compensated as a whole (`features.measured`); for single points
and lines the radius of the ball is subtracted along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, unit
from ocmm_core.measuring._point import Refusal, RefusalCode
from ocmm_core.measuring._trigger import Touch, approach_direction
from ocmm_core.tracking import ProbeBody

METHODS = ("approach", "pulled", "shank", "nominal")
"""By approach or retraction of the ball, axis of the probe, or normal of the nominal surface."""

WORDS = {"approach": "trail", "pulled": "pulled", "shank": "shank", "nominal": "nominal"}
"""Values of `MeasuredPoint.approach`."""


@dataclass(frozen=True, slots=True)
class Side:
    """Side of the probe at a touch."""

    direction: Float
    """(3,), unit, world: from the material towards the probe."""
    word: str


def side_of(
    method: str,
    touch: Touch,
    tip_world: Float,
    rotation_world_from_probe: Float,
    body: ProbeBody,
    approach_mm: float,
    nominal_normal: Float | None,
    time_s: float,
) -> Side | Refusal:
    """Return the direction of a point, or the reason why it is unknown.

    A ball that approached from behind the nominal surface, or against the axis of the probe, is
    refused. ``approach_mm`` is the required straight path of the ball; ``nominal_normal`` (3,),
    unit, world, is None if unknown.
    """
    came = approach_direction(touch.trail_world, tip_world, approach_mm)
    match method:
        case "approach":
            if came is None:
                return _refused(
                    "The approach direction of the ball is unknown.",
                    f"Move it away by {approach_mm:g} mm or more and touch again.",
                    time_s,
                )
            return Side(came, WORDS[method])
        case "pulled":
            pulled = approach_direction(touch.pull_world[::-1], tip_world, approach_mm)
            if pulled is None:
                return _refused(
                    "The ball was not retracted square to the surface after the touch.",
                    "Touch again and, once the point is taken, retract the ball by "
                    f"{4.0 * approach_mm:g} mm, square to the surface.",
                    time_s,
                )
            return Side(pulled, WORDS[method])
        case "shank":
            direction = rotation_world_from_probe @ shank_axis(body)
        case _:
            if nominal_normal is None or not np.any(nominal_normal):
                return _refused(
                    "The nominal surface direction is unknown here: the part frame is not "
                    "measured yet, or the ball is far from the nominal surface.",
                    "Measure the datum features first, or choose the approach direction instead.",
                    time_s,
                )
            direction = nominal_normal
    if came is not None and float(came @ direction) < 0.0:
        which = "the probe points" if method == "shank" else "the nominal surface faces"
        return _refused(
            (
                f"The ball approached from the side opposite to where {which}: one of the "
                "two is wrong."
            ),
            "Touch again from outside the material, or choose the approach direction instead.",
            time_s,
        )
    return Side(direction, WORDS[method])


def shank_axis(body: ProbeBody) -> Float:
    """Return the axis of the probe, (3,), unit, probe frame: from the ball to its LEDs."""
    return unit(body.leds_probe.mean(axis=0) - body.tip_probe)


def _refused(what: str, remedy: str, time_s: float) -> Refusal:
    return Refusal(RefusalCode.NO_APPROACH, what, remedy, time_s)
