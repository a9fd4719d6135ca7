"""A part with exact errors of form, direction and place: touches without noise, nominals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.zones import Characteristic
from tests.core.features.exact_touches import touches

PLACES = (
    RigidTransform(rotation_from_vector(np.array([0.4, -0.7, 1.1])), np.array([120.0, -80.0, 950])),
    RigidTransform(rotation_from_vector(np.array([-1.9, 0.3, 0.5])), np.array([-700.0, 40.0, 80])),
)
"""The place of the part in the world."""

TURN = np.deg2rad(30.0) * np.arange(12)


def motion(x: float, y: float, z: float, *turn: float) -> RigidTransform:
    """Return a motion by (x, y, z), mm, after a turn (3,), rad."""
    return RigidTransform(rotation_from_vector(np.array(turn or (0, 0, 0))), np.array([x, y, z]))


def face(
    T: RigidTransform, size: float = 40.0, height: Callable[[Float, Float], Float] | None = None
) -> tuple[Float, Float]:
    """Return 3 by 3 points of the plane z = 0 of ``T``, with heights (x, y), and normals."""
    x, y = (a.ravel() for a in np.meshgrid(*[np.linspace(-0.5, 0.5, 3) * size] * 2))
    z = np.zeros(9) if height is None else height(x, y)
    return T.apply(np.stack([x, y, z], axis=1)), np.tile(T.rotation[:, 2], (9, 1))


def ring(
    T: RigidTransform,
    radius: float,
    heights: Sequence[float] = (0.0,),
    bulge: Callable[[Float], Float] | None = None,
    inner: bool = False,
) -> tuple[Float, Float]:
    """Return 12 points around z at every height, and normals away from the material."""
    out = np.stack([np.cos(TURN), np.sin(TURN), np.zeros(12)], axis=1)
    r = radius + (np.zeros(12) if bulge is None else bulge(TURN))
    surface = np.vstack([r[:, None] * out + [0.0, 0.0, z] for z in heights])
    normals = np.tile(-out if inner else out, (len(heights), 1))
    return T.apply(surface), normals @ T.rotation.T


def ball(T: RigidTransform, radius: float) -> tuple[Float, Float]:
    """Return 14 points of a ball: its poles and the corners of a cube, and both ends of x and y."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    corners = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)]) / np.sqrt(3)
    normals = np.vstack([axes, corners])
    return T.apply(radius * normals), normals @ T.rotation.T


def edge(T: RigidTransform, heights: Sequence[float], length: float) -> tuple[Float, Float]:
    """Return points along x of ``T`` with heights in z, probed from z."""
    x = np.linspace(-0.5, 0.5, len(heights)) * length
    surface = np.stack([x, np.zeros(len(x)), np.array(heights)], axis=1)
    return T.apply(surface), np.tile(T.rotation[:, 2], (len(x), 1))


class KnownPart:
    """Features by name: their plan, and the touched points."""

    def __init__(self, place: RigidTransform = PLACES[0]) -> None:
        self.place = place
        self.nominals: list[NominalFeature] = []
        self.points: list[MeasuredPoint] = []

    def add(
        self, name: str, shape: Shape, probed: tuple[Float, Float], **nominal: object
    ) -> KnownPart:
        """Add a feature with its points and normals in the part frame."""
        surface, normals = probed
        said = {"name": name, "shape": shape.value, "points": len(surface), "point": (0, 0, 0)}
        self.nominals.append(msgspec.convert({**said, **nominal}, NominalFeature, strict=False))
        self.points += touches(
            name,
            self.place.apply(surface),
            normals @ self.place.rotation.T,
            first=len(self.points) + 1,
        )
        return self

    def actual(self, points: Sequence[MeasuredPoint] | None = None) -> dict[str, ActualFeature]:
        """Return the features as measured."""
        found = actual_features(self.nominals, self.points if points is None else points)
        errors = [item for item in found.values() if not isinstance(item, ActualFeature)]
        if errors:
            raise errors[0]
        return {k: v for k, v in found.items() if isinstance(v, ActualFeature)}


def asked(kind: str, features: str, datums: str = "", **more: object) -> Characteristic:
    """Return a characteristic of features and datums that are listed with commas."""
    listed = [[name for name in text.split(",") if name] for text in (features, datums)]
    said = {"name": "it", "kind": kind, "features": listed[0], "datums": listed[1], "upper": 0.1}
    return msgspec.convert({**said, **more}, Characteristic)
