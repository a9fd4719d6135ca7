"""The part with exact errors for tests of every kind of characteristic."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ocmm_core.alignment import DatumAlignment
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.tolerances.zones import Frames
from tests.core.features.exact_touches import moved
from tests.core.tolerances.known_part import PLACES, KnownPart, ball, edge, face, motion, ring

TILT = 1e-3
"""rad: of all that is tilted."""

RULE = DatumAlignment(primary="top", secondary=("pin", "hole"), origin="pin")


@lru_cache(maxsize=2)
def known(place: int = 0) -> KnownPart:
    """Return the part; its frame has the top as z and the pin as origin."""
    part = KnownPart(PLACES[place])
    h = 0.02
    add = part.add
    add("top", Shape.PLANE, face(motion(0, 0, 0)))
    # Square to the top, and turned about its normal, which a datum plane leaves open.
    left = motion(-50.0, 0, -20, 0, -np.pi / 2, 0)
    add("left", Shape.PLANE, face(left), point=(-50, 0, -20), direction=(-1, 0, 0))
    front = motion(0, -50.0, -20, np.pi / 2, 0, 0)
    add("front", Shape.PLANE, face(front), point=(0, -50, -20), direction=(0, -1, 0))
    add("pin", Shape.CYLINDER, ring(motion(0, 0, 0), 10.0, (5, 15, 25)), point=(0, 0, 15),
        diameter=20.0)  # fmt: skip
    off = motion(60.03, 0.04, 15)
    add("hole", Shape.CYLINDER, ring(off, 6.0, (-10, 0, 10), inner=True), point=(60, 0, 15),
        diameter=11.9, side="inner")  # fmt: skip
    add("leaning", Shape.CYLINDER, ring(motion(0, 60, 0, 0, TILT, 0), 8.0, (0, 10, 20, 30)),
        point=(0, 60, 15), diameter=16.0)  # fmt: skip
    add("wavy", Shape.PLANE, face(motion(0, 100, 5), 40.0, lambda x, y: h * x * y / 400.0),
        point=(0, 100, 5))  # fmt: skip
    add("steep", Shape.PLANE, face(motion(0, 140, 7, TILT, 0, 0)), point=(0, 140, 7))
    yaw = motion(80, 80, 0).compose(motion(0, 0, 0, 0, 0, 0.02)).compose(
        motion(0, 0, 0, 0, np.pi / 2 + TILT, 0))  # fmt: skip
    add("wall", Shape.PLANE, face(yaw), point=(80, 80, 0), direction=(1, 0, 0))
    add("ramp", Shape.PLANE, face(motion(150, 0, 0, 0, np.pi / 3, 0)), point=(150, 0, 0),
        direction=(0.75**0.5, 0, 0.5))  # fmt: skip
    three = ring(motion(0, -90, 3), 15.0, bulge=lambda t: h * np.cos(3 * t))
    add("lobed", Shape.CIRCLE, three, point=(0, -90, 3), diameter=30.0)
    oval = ring(motion(50, -90, 3), 15.0, bulge=lambda t: h * np.cos(2 * t), inner=True)
    add("oval", Shape.CIRCLE, oval, point=(50, -90, 3), diameter=30.0, side="inner")
    tube = ring(motion(0, -150, 0), 12.0, (0, 20, 40), bulge=lambda t: h * np.cos(3 * t))
    add("tube", Shape.CYLINDER, tube, point=(0, -150, 20), diameter=24.0)
    bent = [ring(motion(x, -200, z), 9.0) for x, z in ((0, 0), (0.03, 20), (0, 40))]
    add("bent", Shape.CYLINDER, (np.vstack([b[0] for b in bent]), np.vstack([b[1] for b in bent])),
        point=(0, -200, 20), diameter=18.0)  # fmt: skip
    add("edge", Shape.LINE, edge(motion(0, -230, 0), [h, -h, h, -h, h], 40.0),
        point=(0, -230, 0), direction=(1, 0, 0))  # fmt: skip
    add("ball", Shape.SPHERE, ball(motion(-80.02, 0.01, 40.02), 12.01), point=(-80, 0, 40),
        diameter=24.0)  # fmt: skip
    add("neck", Shape.CYLINDER, ring(motion(0.05, 0, 0), 7.0, (30, 40)), point=(0, 0, 35),
        diameter=14.0)  # fmt: skip
    add("collar", Shape.CIRCLE, ring(motion(0.05, 0, 45), 6.0), point=(0, 0, 45), diameter=12.0)
    swash = motion(0, 0, 50, TILT, 0, 0)
    radial = ring(swash, 16.0)
    add("disc", Shape.PLANE, (radial[0], np.tile(swash.rotation[:, 2], (12, 1))), point=(0, 0, 50))
    plus = motion(0, 10.04, -20, -np.pi / 2, 0, 0)
    minus = motion(0, -9.98, -20, np.pi / 2, 0, 0)
    add("lug plus", Shape.PLANE, face(plus), point=(0, 10, -20), direction=(0, 1, 0))
    add("lug minus", Shape.PLANE, face(minus), point=(0, -10, -20), direction=(0, -1, 0))
    middle = motion(0, 0, -20, np.pi / 2, 0, 0)
    add("middle", Shape.PLANE, face(middle), point=(0, 0, -20), direction=(0, -1, 0))
    add("window", Shape.RECTANGLE, _window(motion(200, 0, 0), 50.0, 16.0), point=(200, 0, 0),
        length=50.0, width=16.0, side="inner")  # fmt: skip
    return part


def _window(place: RigidTransform, length: float, width: float) -> tuple[Float, Float]:
    """Return touches of the four sides of an opening, and the normals away from the material."""
    points, normals = [], []
    for sign in (1.0, -1.0):
        for along in (-12.0, -6.0, 0.0, 6.0, 12.0):
            points.append((along, 0.5 * sign * width, 0.0))
            normals.append((0.0, -sign, 0.0))
        for across in (-5.0, 0.0, 5.0):
            points.append((0.5 * sign * length, across, 0.0))
            normals.append((-sign, 0.0, 0.0))
    return place.apply(np.array(points)), np.array(normals) @ place.rotation.T


@lru_cache(maxsize=2)
def measured(place: int = 0) -> dict[str, ActualFeature]:
    """Return the features of the part."""
    return known(place).actual()


@lru_cache(maxsize=4)
def frames(place: int = 0) -> Frames:
    """Return the frames of the part."""
    return Frames(measured(place), RULE)


@lru_cache(maxsize=1)
def scattered() -> tuple[KnownPart, Float]:
    """Return the part with noise of 0.01 mm on every coordinate: no two points are alike."""
    part = known()
    noise = np.random.default_rng(11).normal(0.0, 0.01, (len(part.points), 3))
    return part, noise


@lru_cache(maxsize=16)
def scattered_at(way: int, by: float) -> dict[str, ActualFeature]:
    """Return the features of the noisy part, all coordinates moved ``by`` along one way."""
    part, noise = scattered()
    shift, ball_shift = a_way(way)
    points = moved(part.points, noise + by * shift)
    radius = points[0].tip_radius + by * ball_shift
    return part.actual([replace(point, tip_radius=radius) for point in points])


@lru_cache(maxsize=16)
def scattered_frames(way: int, by: float) -> Frames:
    """Return their frames."""
    return Frames(scattered_at(way, by), RULE)


def a_way(way: int) -> tuple[Float, float]:
    """Return a direction in the space of all coordinates: of the ball centres, and the ball."""
    rng = np.random.default_rng(100 + way)
    return rng.normal(size=(len(known().points), 3)), float(rng.normal())
