"""Touches without any error, for the tests of compensation and of what rests on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, Points3, RigidTransform
from ocmm_core.measuring import MeasuredPoint
from tests.core.features.shape_samples import HALF_ANGLE, OUTLINES, RADIUS, SECOND, ideal_points

TIP_RADIUS = 1.5


def touches(
    feature: str, surface: Points3, normals: Points3, first: int = 1, tip_radius: float = TIP_RADIUS
) -> list[MeasuredPoint]:
    """Return one touch for every surface point (n, 3) with outward normal (n, 3)."""
    return [
        MeasuredPoint(
            number=first + i,
            feature=feature,
            time_s=float(first + i),
            first_frame=0,
            last_frame=99,
            n_frames=100,
            tip_world=point + tip_radius * normal,
            random_covariance=np.zeros((3, 3)),
            direction=normal,
            tip_radius=tip_radius,
            rotation_world_from_probe=np.eye(3),
            spots=np.full((2, 6, 2), np.nan),
            chi2_per_dof=1.0,
            approach="nominal",
        )
        for i, (point, normal) in enumerate(zip(surface, normals, strict=True))
    ]


def slanted(
    points: Sequence[MeasuredPoint], rng: np.random.Generator, by: float = 0.3
) -> list[MeasuredPoint]:
    """Return the same touches with approaches off the normal by about ``by`` rad."""
    turned = [point.direction + by * rng.normal(size=3) / 2.0 for point in points]
    return [
        replace(point, direction=direction / np.linalg.norm(direction))
        for point, direction in zip(points, turned, strict=True)
    ]


def moved(points: Sequence[MeasuredPoint], by: Float) -> list[MeasuredPoint]:
    """Return the touches with ball centres moved by (n, 3), mm."""
    return [
        replace(point, tip_world=point.tip_world + shift)
        for point, shift in zip(points, by, strict=True)
    ]


def nudged(points: Sequence[MeasuredPoint], i: int, by: float) -> list[MeasuredPoint]:
    """Return the points with coordinate ``i`` moved; the last coordinate is the tip radius."""
    if i == 3 * len(points):
        return [replace(point, tip_radius=point.tip_radius + by) for point in points]
    shifts = np.zeros((len(points), 3))
    shifts.flat[i] = by
    return moved(points, shifts)


def nominal(
    name: str, shape: Shape, diameter: float = 0.0, side: str = "outer", projection: str = ""
) -> NominalFeature:
    """Return a nominal feature whose place does not matter."""
    return NominalFeature(
        name=name,
        shape=shape,
        points=1,
        point=(0.0, 0.0, 0.0),
        diameter=diameter,
        side="inner" if side == "inner" else "outer",
        projection=projection,
    )


def round_touches(
    name: str,
    shape: Shape,
    diameter: float,
    side: str,
    motion: RigidTransform,
    n: int = 12,
    first: int = 1,
) -> list[MeasuredPoint]:
    """Return touches of a circle, sphere or cylinder at the origin of ``motion``, along its z."""
    turn = np.arange(n) * 2.4
    height = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    if shape is Shape.SPHERE:
        ring = np.sqrt(1.0 - height**2)
        normals = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
        surface = 0.5 * diameter * normals
    else:
        normals = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
        surface = 0.5 * diameter * normals
        if shape is Shape.CYLINDER:
            surface[:, 2] = diameter * np.sin(3.0 * height)
    if side == "inner":
        normals = -normals
    return touches(name, motion.apply(surface), normals @ motion.rotation.T, first)


def shape_touches(
    name: str, shape: Shape, side: str, motion: RigidTransform, n: int = 14, first: int = 1
) -> list[MeasuredPoint]:
    """Return touches of one of the other closed shapes, of the sizes of `shape_samples`."""
    surface = ideal_points(shape, np.random.default_rng(30), n)
    if shape in (Shape.SQUARE_SLOT, Shape.RECTANGLE):
        # A ball does not reach into a corner.
        end = np.abs(surface[:, 0]) > RADIUS - 1e-9
        surface[end, 1] = np.clip(surface[end, 1], 2.0 - SECOND, SECOND - 2.0)
        surface[~end, 0] = np.clip(surface[~end, 0], 2.0 - RADIUS, RADIUS - 2.0)
    x, y = surface[:, 0], surface[:, 1]
    normals = np.zeros((n, 3))
    match shape:
        case Shape.CONE:
            around = surface[:, :2] / np.hypot(x, y)[:, None]
            normals[:, :2] = np.cos(HALF_ANGLE) * around
            normals[:, 2] = -np.sin(HALF_ANGLE)
        case Shape.TORUS:
            ring = RADIUS * surface[:, :2] / np.hypot(x, y)[:, None]
            normals = (surface - np.column_stack([ring, np.zeros(n)])) / SECOND
        case Shape.ELLIPSE:
            gradient = np.stack([x / RADIUS**2, y / SECOND**2], axis=1)
            normals[:, :2] = gradient / np.linalg.norm(gradient, axis=1)[:, None]
        case Shape.ROUND_SLOT:
            core = np.clip(x, SECOND - RADIUS, RADIUS - SECOND)
            normals[:, :2] = np.stack([x - core, y], axis=1) / SECOND
        case _:
            end = np.abs(x) > RADIUS - 1e-9
            normals[end, 0] = np.sign(x[end])
            normals[~end, 1] = np.sign(y[~end])
    if side == "inner":
        normals = -normals
    return touches(name, motion.apply(surface), normals @ motion.rotation.T, first)


def shape_nominal(name: str, shape: Shape, side: str, projection: str = "") -> NominalFeature:
    """Return the nominal feature of `shape_touches`."""
    outline = shape in OUTLINES
    return NominalFeature(
        name=name,
        shape=shape,
        points=14,
        point=(0.0, 0.0, 0.0),
        diameter=0.0 if outline else 2.0 * RADIUS,
        length=2.0 * RADIUS if outline else 0.0,
        width=2.0 * SECOND if shape is not Shape.CONE else 0.0,
        angle_deg=float(np.degrees(2.0 * HALF_ANGLE)) if shape is Shape.CONE else 0.0,
        side="inner" if side == "inner" else "outer",
        projection=projection,
    )


def flat_touches(
    name: str, motion: RigidTransform, n: int = 9, size: float = 60.0, first: int = 1
) -> list[MeasuredPoint]:
    """Return touches of the plane z = 0 of ``motion``, from its positive side."""
    turn = np.arange(n) * 2.4
    arm = size / 2.0 * np.sqrt((np.arange(n) + 0.5) / n)
    surface = np.stack([arm * np.cos(turn), arm * np.sin(turn), np.zeros(n)], axis=1)
    return touches(name, motion.apply(surface), np.tile(motion.rotation[:, 2], (n, 1)), first)


def zigzag(count: int) -> Float:
    """Return places on ten lines over 120 mm x 80 mm."""
    share = np.linspace(0.0, 10.0, count, endpoint=False)
    u, line = share % 1.0, np.floor(share)
    return np.stack([120.0 * np.where(line % 2, 1.0 - u, u), 8.0 * line, 0.0 * u], axis=1)
