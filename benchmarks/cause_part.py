"""The part of `benchmarks.causes`: a block with 14 features, its plan, touches without error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import msgspec
import numpy as np

from ocmm_core.alignment import DatumReferenceFrame
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TipSensitivity, load_probe, tip_sensitivity

NOISE_MM = 0.003
"""Standard deviation of an averaged point, each axis, as its own window shows it."""

T_WORLD_FROM_PART = RigidTransform(
    rotation_from_vector(np.array([0.02, -0.03, 0.05])), np.array([5.0, -8.0, -40.0])
)
DATUMS = ("TOP", "FRONT", "LEFT")


@dataclass(frozen=True, slots=True)
class Probed:
    """One feature with its touches, part frame.

    Attributes
    ----------
    nominal
        From the plan.
    surface, normals
        (n, 3) each: touched places, mm, and directions out of the material.
    """

    nominal: NominalFeature
    surface: Float
    normals: Float


def _plane(
    name: str, point: Sequence[float], normal: Sequence[float], size: tuple[float, float],
    grid: tuple[int, int],
) -> Probed:  # fmt: skip
    direction, centre = np.array(normal, dtype=float), np.array(point, dtype=float)
    # The longer side is along x, or along y if the face is directed along x.
    along = np.array([0.0, 1.0, 0.0]) if abs(direction[0]) > 0.5 else np.array([1.0, 0.0, 0.0])
    beside = np.cross(direction, along)
    u, v = (
        a.ravel()
        for a in np.meshgrid(
            *(0.4 * side * np.linspace(-1.0, 1.0, k) for side, k in zip(size, grid, strict=True))
        )
    )
    surface = centre + np.outer(u, along) + np.outer(v, beside)
    nominal = {
        "name": name, "shape": "Plane", "points": len(u), "point": tuple(point),
        "direction": tuple(normal), "across": tuple(along.tolist()),
        "length": size[0], "width": size[1],
    }  # fmt: skip
    return Probed(
        msgspec.convert(nominal, NominalFeature), surface, np.tile(direction, (len(u), 1))
    )


def round_feature(
    name: str, shape: str, point: Sequence[float], diameter: float, side: str,
    turns: Float, heights: Float,
) -> Probed:  # fmt: skip
    """Return a circle, cylinder or ball with touches at ``turns``, rad, and ``heights``, mm."""
    sign = 1.0 if side == "outer" else -1.0
    radius = 0.5 * diameter
    out = np.stack([np.cos(turns), np.sin(turns), np.zeros(len(turns))], axis=1)
    if shape == "Sphere":
        rise = heights / radius
        out = out * np.sqrt(1.0 - rise**2)[:, None]
        out[:, 2] = rise
        surface = radius * out
    else:
        surface = radius * out
        surface[:, 2] = heights
    nominal = {
        "name": name, "shape": shape, "points": len(turns), "point": tuple(point),
        "direction": (0.0, 0.0, 1.0), "diameter": diameter, "side": side,
        "projection": "TOP" if shape == "Circle" else "",
    }  # fmt: skip
    return Probed(msgspec.convert(nominal, NominalFeature), np.array(point) + surface, sign * out)


def turns_of(count: int) -> Float:
    """Return angles all round, rad."""
    found: Float = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    return found


def block() -> tuple[Probed, ...]:
    """Return the features of the block, in the order of the plan."""
    eight, none = turns_of(8), np.zeros(8)
    two_rings = np.concatenate([turns_of(6), turns_of(6) + 0.5])
    return (
        _plane("TOP", (0, 0, 40), (0, 0, 1), (300, 120), (3, 3)),
        _plane("FRONT", (0, -60, 20), (0, -1, 0), (300, 30), (3, 2)),
        _plane("LEFT", (-150, 0, 20), (-1, 0, 0), (120, 30), (3, 2)),
        _plane("RIGHT", (150, 0, 20), (1, 0, 0), (120, 30), (3, 2)),
        _plane("BACK", (0, 60, 20), (0, 1, 0), (300, 30), (3, 2)),
        _plane("STEP", (60, -30, 25), (0, 0, 1), (50, 40), (3, 2)),
        Probed(
            msgspec.convert(
                {"name": "CORNER", "shape": "Point", "points": 1, "point": (-60, -30, 40),
                 "direction": (0, 0, 1)},
                NominalFeature,
            ),
            np.array([[-60.0, -30.0, 40.0]]), np.array([[0.0, 0.0, 1.0]]),
        ),
        round_feature("BORE_A", "Circle", (-120, -40, 40), 20.0, "inner", eight, none - 4.0),
        round_feature("BORE_B", "Circle", (120, -40, 40), 20.0, "inner", eight, none - 4.0),
        round_feature("BORE_C", "Circle", (120, 40, 40), 20.0, "inner", eight, none - 4.0),
        round_feature("BORE_D", "Circle", (-120, 40, 40), 16.0, "inner", eight, none - 4.0),
        round_feature("BOSS", "Cylinder", (0, 0, 55), 30.0, "outer", two_rings,
                      np.repeat([-10.0, 10.0], 6)),
        round_feature("PIN", "Cylinder", (60, 30, 50), 12.0, "outer", two_rings,
                      np.repeat([-7.0, 7.0], 6)),
        round_feature("BALL", "Sphere", (-60, 20, 60), 20.0, "outer",
                      np.concatenate([[0.0], turns_of(8)]), np.array([9.99] + [3.0, -1.0] * 4)),
    )  # fmt: skip


def block_plan(features: Sequence[Probed]) -> Plan:
    """Return the plan of the block."""
    at = {"nominal": 0.0, "lower": -0.06, "upper": 0.06}
    size = {"lower": -0.05, "upper": 0.05}
    asked: list[dict[str, object]] = [
        {"name": f"{name} diameter", "kind": "diameter", "features": [name], "nominal": d, **size}
        for name, d in (("BORE_A", 20.0), ("BORE_B", 20.0), ("BORE_C", 20.0), ("BORE_D", 16.0),
                        ("BOSS", 30.0), ("PIN", 12.0), ("BALL", 20.0))
    ]  # fmt: skip
    asked += [
        {"name": f"{name} {axis}", "kind": "coordinate", "features": [name], "axis": axis,
         **at, "nominal": value}
        for name, axis, value in (
            ("BORE_A", "x", -120.0), ("BORE_B", "x", 120.0), ("BORE_C", "x", 120.0),
            ("BORE_C", "y", 40.0), ("BORE_D", "y", 40.0), ("BOSS", "x", 0.0), ("BALL", "z", 60.0),
            ("CORNER", "z", 40.0),
        )
    ]  # fmt: skip
    asked += [
        {"name": "Length", "kind": "distance", "features": ["LEFT", "RIGHT"], "nominal": 300.0,
         **size},
        {"name": "Width", "kind": "distance", "features": ["FRONT", "BACK"], "nominal": 120.0,
         **size},
        {"name": "Depth", "kind": "distance", "features": ["STEP", "TOP"], "nominal": 15.0,
         **size},
        {"name": "A to B", "kind": "distance", "features": ["BORE_A", "BORE_B"], "nominal": 240.0,
         **size},
        {"name": "C place", "kind": "position", "features": ["BORE_C"], "datums": [*DATUMS],
         "upper": 0.12, "zone": "cylinder"},
        {"name": "STEP to TOP", "kind": "parallelism", "features": ["STEP"], "datums": ["TOP"],
         "upper": 0.06},
        {"name": "BOSS to TOP", "kind": "perpendicularity", "features": ["BOSS"],
         "datums": ["TOP"], "upper": 0.06},
        {"name": "TOP flat", "kind": "flatness", "features": ["TOP"], "upper": 0.06},
        {"name": "BORE_A round", "kind": "roundness", "features": ["BORE_A"], "upper": 0.06},
    ]  # fmt: skip
    return Plan(
        schema="ocmm.plan/1", unit="mm", name="CAUSES", part="BLOCK",
        features=[item.nominal for item in features],
        characteristics=[msgspec.convert(item, Characteristic) for item in asked],
        alignment=DatumReferenceFrame(datums=DATUMS),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Station:
    """The equipment for the block, and touches without error.

    Attributes
    ----------
    rig, body
        Cameras and probe.
    points
        Without error, world; sensitivities are those of their spots.
    sensitivities
        One for each point.
    """

    rig: Rig
    body: ProbeBody
    points: tuple[MeasuredPoint, ...]
    sensitivities: tuple[TipSensitivity, ...]


@cache
def station() -> Station:
    """Return cameras, probe and the touches of the block without error."""
    rig = load_rig(resource("rigs", "recommended.toml"))
    body = load_probe(resource("probes", "standard.toml"))
    points = touched(block(), body, rig)
    found = tuple(tip_sensitivity(point.spots, rig, body) for point in points)
    return Station(rig, body, points, found)


def touched(features: Sequence[Probed], body: ProbeBody, rig: Rig) -> tuple[MeasuredPoint, ...]:
    """Return the touches of features, the probe upright."""
    found: list[MeasuredPoint] = []
    for feature in features:
        surface = T_WORLD_FROM_PART.apply(feature.surface)
        normals = feature.normals @ T_WORLD_FROM_PART.rotation.T
        for place, normal in zip(surface, normals, strict=True):
            tip = place + body.tip_radius * normal
            leds = tip - body.tip_probe + body.leds_probe
            found.append(
                MeasuredPoint(
                    number=len(found) + 1,
                    feature=feature.nominal.name,
                    time_s=float(len(found)),
                    first_frame=0,
                    last_frame=99,
                    n_frames=100,
                    tip_world=tip,
                    random_covariance=NOISE_MM**2 * np.eye(3),
                    direction=normal,
                    tip_radius=body.tip_radius,
                    rotation_world_from_probe=np.eye(3),
                    spots=np.stack([project(camera, leds) for camera in rig.cameras]),
                    chi2_per_dof=1.0,
                    approach="trail",
                )
            )
    return tuple(found)
