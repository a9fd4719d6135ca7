"""Verification of the virtual rig from averaged spots, fast enough for many runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np

from ocmm_core.calibration.guided import sigma_of_mean
from ocmm_core.calibration.tip import QUALIFICATION_RINGS, frame_about, sphere_layout
from ocmm_core.calibration.verification import (
    LINES,
    RESULT,
    SEATS_AGAIN,
    SEATS_FIRST,
    SPHERES,
    VerificationProcedure,
)
from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_sim.calibration_scenes import SEATS, stand_of
from tests.core.calibration.virtual_rests import VirtualRests, places_of_bar

FRAMES = 100
"""Averaged per rest."""

_BETWEEN = timedelta(seconds=15)
_LAID_MM = 3.0
"""Maximum error of a hand-placed bar, per axis."""


def verify_at_once(
    procedure: VerificationProcedure,
    spots: VirtualRests,
    begin: datetime,
    seed: int,
    *,
    scale: float = 1.0,
    seat_sigma_mm: float = 0.001,
    before: Callable[[int], None] | None = None,
    elsewhere: Mapping[int, Float] | None = None,
) -> datetime:
    """Record all remaining steps of a verification; return the end time.

    ``scale``: true over nominal bar length; ``seat_sigma_mm``: repeatability of a seat, nest or
    surface contact, standard deviation per axis; ``before``: called before each rest with its
    number, to inject changes; ``elsewhere`` (3,), mm, by line number: offset of the bar from its
    planned place.
    """
    rng = np.random.default_rng([seed, 62])
    now, rest = begin, 0
    sigma = sigma_of_mean(spots.rig, FRAMES)

    def touch(tip: Float, normal: Float | None = None) -> None:
        nonlocal now, rest
        if before is not None:
            before(rest)
        rest += 1
        now += _BETWEEN
        held = spots.hold(tip, normal)
        seated = tip + seat_sigma_mm * rng.standard_normal(3)
        procedure.take_shot(spots.spots(seated, held), sigma, now)

    low, high = spots.rig.volume_world
    seats = low + SEATS * (high - low)
    while procedure.base.step.name != RESULT:
        view = procedure.view
        step = view.base.step.name
        if step == SEATS_FIRST:
            for seat in seats[len(view.seats_world) :]:
                touch(seat)
        elif step == LINES:
            for number, line in enumerate(view.lines):
                away = (elsewhere or {}).get(number, np.zeros(3))
                ends = line.ends_world + away + rng.uniform(-_LAID_MM, _LAID_MM, 3)
                for nest in places_of_bar(ends, procedure.bar.nests, scale)[line.taken :]:
                    touch(nest)
        elif step == SPHERES:
            for number, sphere in enumerate(procedure.spheres):
                centre = stand_of(spots.rig, view.places[number], number)
                layout = sphere_layout(
                    QUALIFICATION_RINGS, frame_about(np.array([0.0, 0.0, 1.0]), spots.rig)
                )
                reach = 0.5 * sphere.diameter + spots.world.tip_radius
                for normal in layout.directions[view.spheres[number] :]:
                    touch(centre + reach * normal, normal)
        elif step == SEATS_AGAIN and view.next_seat is not None:
            for seat in seats[view.next_seat :]:
                touch(seat)
        procedure.advance(now)
    return now


def turned(camera: CameraModel, turn: Float) -> CameraModel:
    """Return a camera turned about its centre by a rotation vector (3,), rad."""
    rotation, pose = rotation_from_vector(turn), camera.T_camera_from_world
    motion = RigidTransform(rotation @ pose.rotation, rotation @ pose.translation)
    return replace(camera, T_camera_from_world=motion)


def nudge(spots: VirtualRests, size_rad: float, rng: np.random.Generator) -> int:
    """Turn one camera about an axis across its view; return its number."""
    number = int(rng.integers(len(spots.cameras)))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    cameras = list(spots.cameras)
    axis = np.array([np.cos(angle), np.sin(angle), 0.0])
    cameras[number] = turned(cameras[number], size_rad * axis)
    spots.cameras = tuple(cameras)
    return number
