"""A small picture of the probe from the inspector: LEDs, their visibility, the turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ocmm_core.camera import Rig
from ocmm_core.coach._prediction import Bool
from ocmm_core.coach._turns import Turn, stance_at
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody


@dataclass(frozen=True, slots=True, eq=False)
class ProbePicture:
    """The probe, flat, about the ball centre; mm, to the right and up."""

    leds: Float
    """(L, 2)."""
    behind: Bool
    """(L,): the LED faces away from the inspector."""
    outline: Float
    """(k, 2): about the LEDs."""
    foot: Float
    """(2,): end of the stylus in the body."""
    ball_radius: float
    """mm."""
    cameras: tuple[str, ...]
    """Names, from left to right for the inspector."""
    seen: Bool
    """(C, L): which of them sees which LED, in that order."""
    turn: Turn | None
    """The turn to make; None if unknown."""
    known: bool = True
    """Whether the attitude is the probe's; else upright with its LEDs to the cameras."""

    def counts(self) -> tuple[tuple[str, int], ...]:
        """Return the name of each camera and the number of LEDs it sees."""
        return tuple(
            (name, int(row.sum())) for name, row in zip(self.cameras, self.seen, strict=True)
        )


def picture_of(
    rig: Rig, body: ProbeBody, rotation: Float | None, seen: Bool, turn: Turn | None
) -> ProbePicture:
    """Return a picture; ``rotation`` (3, 3): rig from probe, or None; ``seen``: (C, L)."""
    stance = stance_at(rig)
    turned = upright_rotation(rig, body) if rotation is None else rotation
    arms = (body.leds_probe - body.tip_probe) @ turned.T
    light = body.led_directions_probe @ turned.T
    leds = stance.flat(arms)
    middle = leds.mean(axis=0)
    nearest = leds[np.argmin(np.linalg.norm(arms, axis=1))]
    reach = float(np.linalg.norm(middle)) or 1.0
    places = stance.flat(np.array([camera.centre_world for camera in rig.cameras]))[:, 0]
    order = np.argsort(places, kind="stable")
    return ProbePicture(
        leds=leds,
        behind=light @ stance.away > 0.0,
        outline=_hull(leds),
        # The stylus ends at the middle of the LEDs; the body begins below the nearest of them.
        foot=middle * min(1.0, 0.75 * float(np.linalg.norm(nearest)) / reach),
        ball_radius=body.tip_radius,
        cameras=tuple(rig.cameras[place].name for place in order),
        seen=seen[order],
        turn=turn,
        known=rotation is not None,
    )


def upright_rotation(rig: Rig, body: ProbeBody) -> Float:
    """Return the attitude (3, 3), rig from probe, upright with the LEDs to the cameras."""
    stance = stance_at(rig)
    handle = unit(body.leds_probe.mean(axis=0) - body.tip_probe)
    looks = body.led_directions_probe.mean(axis=0)
    looks = looks - (looks @ handle) * handle
    if np.linalg.norm(looks) < 1e-6:
        return np.eye(3)
    looks = unit(looks)
    own = np.array([np.cross(looks, handle), looks, handle])
    world = np.array([stance.right, stance.away, stance.up])
    found: Float = world.T @ own
    return found


def _hull(points: Float) -> Float:
    """Return the convex hull of points (n, 2), anticlockwise; all of them if collinear."""
    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return points
