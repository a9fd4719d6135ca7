"""Turns of the probe about the resting ball, their names and a small picture for the inspector.

He faces the cameras at the part, with his hand behind the LEDs and his body out of the light; the
screen is beside the cameras. Left and right, towards and away are his; the picture of the probe is
his view and says so (decision 74). So is the ellipsoid of the present uncertainty of the ball.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, rotation_from_vector, unit
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivities

UP_WORLD = (0.0, 0.0, 1.0)
"""The Z axis of every rig document points up."""
_LEAST = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """The directions of the inspector, (3,), unit, world."""

    right: Float
    up: Float
    away: Float
    """`away` leads towards the cameras. (right, away, up) is right-handed."""

    def flat(self, vectors: Float) -> Float:
        """Return his view of vectors (..., 3), mm, world: (..., 2), to the right and up."""
        return np.stack([vectors @ self.right, vectors @ self.up], axis=-1)


def stance_at(rig: Rig) -> Stance:
    """Return his directions before the cameras of a rig."""
    up = np.array(UP_WORLD)
    middle = rig.volume_world.mean(axis=0)
    towards = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - middle
    level = towards - (towards @ up) * up
    # With cameras straight above the part, every direction is equally good.
    away = unit(level) if np.linalg.norm(level) > _LEAST else np.array([0.0, -1.0, 0.0])
    return Stance(np.cross(away, up), up, away)


STEPS_DEG = (10, 15, 20, 30, 45)
"""A hand is no finer than the first, and seldom exceeds the last at once."""


class Way(Enum):
    """Direction of a turn for the inspector: of the LEDs or the top of the probe."""

    TURN_LEFT = "turn_left"
    TURN_RIGHT = "turn_right"
    LEAN_LEFT = "lean_left"
    LEAN_RIGHT = "lean_right"
    TILT_TOWARDS = "tilt_towards"
    TILT_AWAY = "tilt_away"


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn about the ball."""

    way: Way
    degrees: int

    def rotation_world(self, stance: Stance) -> Float:
        """Return the rotation (3, 3) of the world about the ball."""
        # A positive turn about up moves what faces away to the left (up x away = -right). The top
        # goes left about -away (-away x up = -right), and towards him about right (right x up =
        # -away).
        axes = {
            Way.TURN_LEFT: stance.up,
            Way.TURN_RIGHT: -stance.up,
            Way.LEAN_LEFT: -stance.away,
            Way.LEAN_RIGHT: stance.away,
            Way.TILT_TOWARDS: stance.right,
            Way.TILT_AWAY: -stance.right,
        }
        return rotation_from_vector(np.radians(self.degrees) * axes[self.way])

    @property
    def instruction(self) -> str:
        """Return the instruction for the hand."""
        if self.way is Way.TURN_LEFT:
            return f"Turn {self.degrees}° left"
        if self.way is Way.TURN_RIGHT:
            return f"Turn {self.degrees}° right"
        if self.way is Way.LEAN_LEFT:
            return f"Lean {self.degrees}° left"
        if self.way is Way.LEAN_RIGHT:
            return f"Lean {self.degrees}° right"
        if self.way is Way.TILT_TOWARDS:
            return f"Tilt {self.degrees}° towards you"
        return f"Tilt {self.degrees}° away from you"


TURNS = tuple(Turn(way, degrees) for way in Way for degrees in STEPS_DEG)

_OPPOSITE = (
    {Way.TURN_LEFT, Way.TURN_RIGHT}, {Way.LEAN_LEFT, Way.LEAN_RIGHT},
    {Way.TILT_TOWARDS, Way.TILT_AWAY},
)  # fmt: skip
PAIRS = tuple(
    (Turn(one, first), Turn(other, second))
    for place, one in enumerate(Way)
    for other in tuple(Way)[place + 1 :]
    if {one, other} not in _OPPOSITE
    for first in (15, 30)
    for second in (15, 30)
)
"""Tried if no single turn suffices; in order."""


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid:
    """Uncertainty ellipsoid of the ball, k = 2 along every axis."""

    half_axes_mm: Float
    """(3,), the longest first: it is the U of the readout."""
    directions_world: Float
    """(3, 3), unit: the axes as rows."""
    outline_mm: Float
    """(3,): half axes of its view, mm, longer first; its angle from his right towards up, rad."""

    @property
    def u_mm(self) -> float:
        """Return U, mm: the longest half axis."""
        return float(self.half_axes_mm[0])


def ellipsoid_of(covariance: Float, stance: Stance) -> Ellipsoid:
    """Return the ellipsoid of a covariance (3, 3), mm^2, world; its views are marginals."""
    values, vectors = np.linalg.eigh(covariance)
    half = COVERAGE_FACTOR * np.sqrt(np.maximum(values[::-1], 0.0))
    across = np.stack([stance.right, stance.up])
    flat, axes = np.linalg.eigh(across @ covariance @ across.T)
    longer, shorter = COVERAGE_FACTOR * np.sqrt(np.maximum(flat[::-1], 0.0))
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    return Ellipsoid(half, vectors.T[::-1], np.array([longer, shorter, angle]))


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
        return points[scipy.spatial.ConvexHull(points).vertices]
    except (scipy.spatial.QhullError, ValueError):
        return points


LEAST_FOR_POSE = 3
"""LEDs seen by two cameras; fewer do not determine the pose."""

Bool = NDArray[np.bool_]
Sensitivities = Callable[[Float], Sequence[TipSensitivity]]
"""From spots (n, C, L, 2), px, to ball sensitivities; raises TrackingError like the core."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """Attitude and visibility of the probe."""

    rotation_world_from_probe: Float
    """(3, 3)."""
    tip_world: Float
    """(3,), mm: of the resting ball."""
    seen: Bool
    """(C, L): which camera sees which LED now."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """LEDs seen by the cameras by the model of their light, and their spots."""

    seen: Bool
    """(n, C, L)."""
    on_sensor: Bool
    """(n, C, L): whether the image of the LED lies on the sensor, lit or not."""
    spots: Float
    """(n, C, L, 2), px, of all LEDs, seen or not."""


def sight_of(
    rig: Rig, body: ProbeBody, rotations: Float, tip_world: Float, margin_rad: float = 0.0
) -> Sight:
    """Return the visibility for attitudes (n, 3, 3) about the ball (3,), mm.

    An LED shines into a cone (`ProbeBody.emission_half_angle`), reduced by ``margin_rad``.
    """
    arms = body.leds_probe - body.tip_probe
    places = np.einsum("nij,lj->nli", rotations, arms) + tip_world
    light = np.einsum("nij,lj->nli", rotations, body.led_directions_probe)
    least = np.cos(max(body.emission_half_angle - margin_rad, 0.0))
    lit, inside, spots = [], [], []
    for camera in rig.cameras:
        ray = camera.centre_world - places
        facing = np.sum(ray * light, axis=2) > least * np.linalg.norm(ray, axis=2)
        uv = project(camera, places)
        there = on_sensor(camera, uv)
        spots.append(uv)
        inside.append(there)
        lit.append(facing & there)
    return Sight(np.stack(lit, axis=1), np.stack(inside, axis=1), np.stack(spots, axis=1))


def common(seen: Bool) -> NDArray[np.int64]:
    """Return the number of LEDs that two cameras see, (n,), from (n, C, L)."""
    count: NDArray[np.int64] = np.count_nonzero(np.count_nonzero(seen, axis=1) >= 2, axis=1)
    return count


def uncertainties(
    sight: Sight, rig: Rig, body: ProbeBody, sensitivities: Sensitivities | None = None
) -> Float:
    """Return U (n,), mm, k = 2, of averaged points, worst direction; NaN without pose.

    The same propagation as for the readout (`measuring.point_uncertainty`), from predicted spots.
    ``sensitivities`` is for a reference body; None for `tracking.tip_sensitivities`.
    """
    found = np.full(len(sight.seen), np.nan)
    usable = np.flatnonzero(common(sight.seen) >= LEAST_FOR_POSE)
    spots = np.where(sight.seen[..., None], sight.spots, np.nan)
    answers = _answers(spots[usable], rig, body, sensitivities)
    kept = [
        (place, answer) for place, answer in zip(usable, answers, strict=True) if answer is not None
    ]
    if kept:
        covariances = covariances_of([answer for _, answer in kept], rig, body)
        worst = COVERAGE_FACTOR * np.sqrt(np.linalg.eigvalsh(covariances)[:, -1])
        found[[place for place, _ in kept]] = worst
    return found


def _answers(
    spots: Float, rig: Rig, body: ProbeBody, sensitivities: Sensitivities | None
) -> Sequence[TipSensitivity | None]:
    if not len(spots):
        return ()

    def plain(uv: Float) -> Sequence[TipSensitivity]:
        return tip_sensitivities(uv, rig, body)

    ask = plain if sensitivities is None else sensitivities
    try:
        return ask(spots)
    except TrackingError:
        # If one of them is degenerate, ask for each alone.
        return [_one(ask, uv) for uv in spots]


def _one(ask: Sensitivities, uv: Float) -> TipSensitivity | None:
    try:
        return ask(uv[None])[0]
    except TrackingError:
        return None


def covariance_of(answer: TipSensitivity, rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance (3, 3), mm^2, of the ball, without its own window."""
    found: Float = covariances_of([answer], rig, body)[0]
    return found


def covariances_of(answers: Sequence[TipSensitivity], rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance of each ball, (n, 3, 3), mm^2.

    Equals `measuring.systematic_covariance` of one point, vectorised because a hint needs up to
    eighty: cameras, probe and reference body, and the field of the sensors' patterns in closed form
    instead of on a grid (`measuring._pattern_field`).
    """
    cameras = np.stack([answer.by_cameras for answer in answers])
    geometry = np.stack([answer.by_geometry for answer in answers])
    common_to_all = np.stack([answer.by_common for answer in answers])
    total = cameras @ rig.parameter_covariance @ cameras.transpose(0, 2, 1)
    total += geometry @ body.geometry_covariance @ geometry.transpose(0, 2, 1)
    total += common_to_all @ common_to_all.transpose(0, 2, 1)
    noise = rig.noise
    if noise.pattern_px > 0.0:
        most = max(len(answer.camera) for answer in answers)
        places = np.zeros((len(answers), most, 2))
        camera = np.full((len(answers), most), -1)
        slopes = np.zeros((len(answers), 3, most, 2))
        for row, answer in enumerate(answers):
            count = len(answer.camera)
            places[row, :count], camera[row, :count] = answer.uv, answer.camera
            slopes[row, :, :count] = noise.pattern_px * answer.by_spots
        # Spots of one camera at distance d share exp(-d^2 / (2 l^2)) of the pattern; spots of two
        # cameras, and u and v, are independent. Unfilled places have zero slope.
        apart = np.sum((places[:, :, None] - places[:, None]) ** 2, axis=3)
        shared = np.exp(-apart / (2.0 * noise.pattern_length_px**2))
        shared *= camera[:, :, None] == camera[:, None]
        for axis in range(2):
            one = slopes[..., axis]
            total += one @ shared @ one.transpose(0, 2, 1)
    return total
