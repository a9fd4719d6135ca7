"""Motions in calibration scenes: rests, travel, hand tremor."""

from __future__ import annotations

import numpy as np
import scipy

from ocmm_core.calibration.verification import PLACES
from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.geometry import Float, perpendicular_pair, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody, satisfies_rules
from ocmm_sim.calibration_scenes import _scenes as scenes
from ocmm_sim.scene import World, attitude_at, draw_tremor, kernels, segment_of

STILL_S, SEATED_S, TRAVEL_S, WAY_S = 0.045, 0.14, 0.06, 0.6


_STILL_FRAMES = 300
"""Minimum frames of a rest: two averages of a hundred, as a step compares them, and the block of
eighty in which it may start."""


_TREMOR = (2e-3, 1.0)
"""Amplitude of a hand in attitude (rad) and place (mm) in segments that let the ball sway;
otherwise a seat holds it."""


_LEAN_ERROR_RAD = np.radians(2.0)
"""Attitude error of a hand."""


_ATTEMPTS = 60


_CELLS = 3


_TILT_RAD, _TURN_RAD = np.radians(40.0), np.radians(25.0)


def rest_s(usual_s: float, rig: Rig) -> float:
    """Return the rest duration that a rig needs to record it."""
    return max(usual_s, _STILL_FRAMES / rig.frame_rate_hz)


def visits(
    places: list[Float], attitudes: list[Float] | None = None, still_s: float = STILL_S
) -> Float:
    """Return segments that bring a body to each place with a rest."""
    turns = attitudes or [np.zeros(3)] * len(places)
    rows: list[Float] = []
    time, place, turn = 0.0, places[0], turns[0]
    for aim, aim_turn in zip(places, turns, strict=True):
        for length, kind in ((TRAVEL_S, kernels.MOVE), (still_s, kernels.REST)):
            rows.append(segment_of(time, length, kind, place, aim, turn, aim_turn))
            time, place, turn = time + length, aim, aim_turn
    return np.array(rows)


def waves(volume_world: Float, scene: scenes.FreeMotionScene, body: ProbeBody) -> Float:
    """Return segments through places and attitudes, each to another cell: the volume is crossed."""
    rng = np.random.default_rng([scene.seed, scenes.STREAM + 1])
    low, high = volume_world
    cells = np.array(list(np.ndindex(_CELLS, _CELLS, _CELLS)))
    rows: list[Float] = []
    place, turn, time = 0.5 * (low + high), np.zeros(3), 0.0
    for number in range(scene.ways):
        if number % len(cells) == 0:
            rng.shuffle(cells)
        cell = cells[number % len(cells)]
        aim = low + (cell + rng.random(3)) / _CELLS * (high - low)
        tilt = rng.uniform(-1.0, 1.0, 3) * np.array([_TILT_RAD, _TILT_RAD, _TURN_RAD])
        # High up the handle points down, so that the LEDs stay in the volume.
        over = np.array([0.0, np.pi if 2 * cell[2] >= _CELLS and not body.rules else 0.0, 0.0])
        attitude = rotation_from_vector(over) @ rotation_from_vector(tilt)
        aim_turn = scipy.spatial.transform.Rotation.from_matrix(attitude).as_rotvec()
        rows.append(segment_of(time, WAY_S, kernels.MOVE, place, aim, turn, aim_turn))
        place, turn, time = aim, aim_turn, time + WAY_S
    return np.array(rows)


def touches(
    scene: scenes.TouchSeats | scenes.TouchSphere, world: World, body: ProbeBody, rig: Rig
) -> Float:
    rng = np.random.default_rng([scene.seed, scenes.STREAM + 2])
    if isinstance(scene, scenes.TouchSeats):
        # A raised seat can be reached from all sides.
        places: list[tuple[Float, Float | None]] = [(np.array(tip), None) for tip in scene.tips]
    else:
        reach = 0.5 * scene.diameter + world.tip_radius
        normals = [unit(np.array(normal)) for normal in scene.normals]
        places = [(np.array(scene.centre) + reach * normal, normal) for normal in normals]
    turns = [best_seen(tip, normal, world, body, rig.volume_world, rng) for tip, normal in places]
    clamped_s = scene.clamped_s if isinstance(scene, scenes.TouchSeats) else 0.0
    return visits([tip for tip, _ in places], turns, clamped_s or rest_s(SEATED_S, rig))


def touches_with_tip(scene: scenes.TouchWithTip, world: World, body: ProbeBody, rig: Rig) -> Float:
    rng = np.random.default_rng([scene.seed, scenes.STREAM + 4])
    places, turns = [], []
    for normal in scenes.unit_vectors(scene.normals):
        tip = np.array(scene.centre) + 0.5 * scene.diameter * normal
        turn = best_seen(tip, normal, world, body, rig.volume_world, rng)
        reach = scenes.reach_of(scene, world.tip_radius, rotation_from_vector(turn), normal)
        places.append(np.array(scene.centre) + reach * normal)
        turns.append(turn)
    for handle in scenes.unit_vectors(scene.handles):
        places.append(np.array(scene.cone))
        turns.append(turn_to(handle + rng.normal(0.0, _LEAN_ERROR_RAD, 3)))
    return visits(places, turns, rest_s(SEATED_S, rig))


def best_seen(
    tip: Float,
    normal: Float | None,
    world: World,
    body: ProbeBody,
    volume_world: Float,
    rng: np.random.Generator,
) -> Float:
    """Return the rotation vector (3,), rad, that shows most LEDs in the calibrated volume."""
    low, high = volume_world
    best, least = np.zeros(3), np.inf
    for _ in range(_ATTEMPTS):
        lean, yaw = rng.uniform(-0.2, 0.2, 2), float(rng.uniform(-0.2, 0.2))
        roll = 0.0 if normal is not None else float(rng.uniform(-np.pi, np.pi))
        if least == 0.0:
            # The best is already seen by all cameras; continue only to keep the random draws.
            continue
        upwards = np.array([0.0, 0.0, 1.0]) if normal is None else normal
        rotation = rotation_from_vector(attitude_at(upwards, lean, yaw, bore=False))
        if normal is None:
            rotation = rotation_from_vector(np.array([0.0, roll, 0.0])) @ rotation
        if not satisfies_rules(body, rotation):
            continue
        leds = tip + (world.leds_probe - world.tip_probe) @ rotation.T
        light = body.led_directions_probe @ rotation.T
        hidden = 0
        for camera in world.cameras:
            towards = unit(camera.centre_world - leds)
            shines = np.sum(towards * light, axis=1) > np.cos(body.emission_half_angle)
            hidden += int(np.count_nonzero(~shines | ~on_sensor(camera, project(camera, leds))))
        outside = float(np.maximum(low - leds, leds - high).max(initial=0.0))
        if 1e3 * hidden + outside < least:
            best = scipy.spatial.transform.Rotation.from_matrix(rotation).as_rotvec()
            least = 1e3 * hidden + outside
    return best


def turn_to(direction: Float) -> Float:
    """Return the rotation vector (3,) from the axis of a bar, z, to a direction."""
    aim = unit(direction)
    axis = np.cross([0.0, 0.0, 1.0], aim)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.pi * perpendicular_pair(aim)[0] if aim[2] < 0.0 else np.zeros(3)
    turned: Float = axis / sine * np.arctan2(sine, aim[2])
    return turned


def tremor(seed: int) -> Float:
    """Return tremor waves (2, 3, K, 3) of a hand with seated ball for `kernels.move`."""
    return draw_tremor(np.random.default_rng([seed, scenes.STREAM + 3]), _TREMOR)


SEATS = np.array([[0.2, 0.25, 0.25], [0.8, 0.7, 0.65]])
"""As fractions of the volume."""
_THIRD = 0.22
"""Depth from the middle: well inside the near or the far third."""


def stand_of(rig: Rig, place: str, number: int) -> Float:
    """Return a sphere stand's centre, (3,), mm, at a place of `verification.PLACES`.

    An empty place is the middle, where spheres are next to each other by number.
    """
    middle = rig.volume_world.mean(axis=0)
    away = unit(middle - np.array([camera.centre_world for camera in rig.cameras]).mean(axis=0))
    reach = _THIRD * float(np.abs(away) @ np.ptp(rig.volume_world, axis=0))
    side = dict(zip(PLACES, (-reach, reach), strict=True)).get(place)
    offset = np.array([60.0 * number, 0.0, 0.0]) if side is None else side * away
    stand: Float = middle + offset
    return stand
