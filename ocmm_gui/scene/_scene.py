"""Items of a small 3-D scene, and their orthographic projection: lengths are comparable."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.geometry import Float

MAX_ELEVATION = np.radians(89.0)
"""A vertical view would have no upright direction."""


@dataclass(frozen=True, slots=True)
class Lines:
    segments: Float
    """(n, 2, 3), mm, world frame."""
    colour: str
    width: float = 1.5


@dataclass(frozen=True, slots=True)
class Dots:
    """Round marks of constant size: (n, 3), mm, world frame; ``size`` in px."""

    points: Float
    colour: str
    size: float = 8.0
    outline: str = ""


@dataclass(frozen=True, slots=True)
class Diamonds:
    """Open diamonds of constant size: (n, 3), mm, world frame; ``size`` in px."""

    points: Float
    colour: str
    size: float = 16.0


@dataclass(frozen=True, slots=True)
class Face:
    """A translucent polygon: corners (n, 3), mm, world frame; ``alpha`` 0 to 255."""

    corners: Float
    colour: str
    alpha: int = 50


@dataclass(frozen=True, slots=True)
class Tag:
    """A label next to a point (3,), mm, world frame."""

    point: Float
    text: str
    colour: str


Item = Lines | Dots | Diamonds | Face | Tag


@dataclass(frozen=True, slots=True)
class ScreenProjection:
    """World to picture: ``(points - target) @ matrix + middle``."""

    target: Float
    """(3,), mm, world."""
    matrix: Float
    """(3, 3): px/mm for x and y of the picture; the third column is the height towards the eye."""
    middle: Float
    """(3,), px."""

    def apply(self, points: Float) -> Float:
        """Return (..., 3): x and y, px from the upper left, and height over the target."""
        # As one product: numpy multiplies a stack of pairs one by one.
        flat = (points.reshape(-1, 3) - self.target) @ self.matrix + self.middle
        projected: Float = flat.reshape(points.shape)
        return projected


@dataclass(frozen=True, slots=True)
class Orbit:
    """A view."""

    target: Float
    """(3,), mm, world: centre of the picture."""
    azimuth: float
    elevation: float
    """`azimuth`, `elevation`: rad: direction of the eye from the target, about ``up`` and above the
    plane across it."""
    radius: float
    """mm: half of the shorter side of the picture."""
    up: Float
    """(3,), unit, world: upright in the picture."""

    def axes(self) -> Float:
        """Return the picture's right, up and outward directions as rows, (3, 3), world."""
        up = tuple(self.up.tolist())
        least = min(range(3), key=lambda axis: abs(up[axis]))
        east = _unit(_cross(up, (float(least == 0), float(least == 1), float(least == 2))))
        north = _cross(up, east)
        ca, sa = math.cos(self.azimuth), math.sin(self.azimuth)
        ce, se = math.cos(self.elevation), math.sin(self.elevation)
        outward = tuple(
            ce * (ca * e + sa * n) + se * u for e, n, u in zip(east, north, up, strict=True)
        )
        right = _unit(_cross(up, outward))
        return np.array([right, _cross(outward, right), outward])

    def projection(self, width: float, height: float) -> ScreenProjection:
        """Return the projection of world points to a picture of that size, px."""
        scale = 0.5 * min(width, height) / self.radius
        return ScreenProjection(
            self.target,
            self.axes().T * np.array([scale, -scale, 1.0]),
            np.array([0.5 * width, 0.5 * height, 0.0]),
        )

    def project(self, points: Float, width: float, height: float) -> Float:
        """Return (..., 3): x and y, px from the upper left, and height over the target."""
        return self.projection(width, height).apply(points)

    def turned(self, azimuth: float, elevation: float) -> Orbit:
        """Return the view after a turn, rad."""
        limit = float(MAX_ELEVATION)
        return replace(
            self,
            azimuth=self.azimuth + azimuth,
            elevation=min(max(self.elevation + elevation, -limit), limit),
        )

    def zoomed(self, factor: float) -> Orbit:
        """Return the view with ``radius`` times ``factor``, kept between 2 mm and 5 m."""
        return replace(self, radius=min(max(self.radius * factor, 2.0), 5000.0))

    def about(self, target: Float) -> Orbit:
        """Return the view from the same side with another centre (3,), mm."""
        return replace(self, target=target)

    def looking_from(self, side: Float) -> Orbit:
        """Return the upright view nearest to a side (3,), unit, world."""
        right, up, out = (replace(self, azimuth=0.0, elevation=0.0).axes() @ side).tolist()
        limit = float(MAX_ELEVATION)
        elevation = min(max(float(np.arcsin(np.clip(up, -1.0, 1.0))), -limit), limit)
        # From straight above any azimuth is valid: keep the current one.
        flat = float(np.hypot(right, out))
        azimuth = float(np.arctan2(right, out)) if flat > 1e-3 else self.azimuth
        return replace(self, azimuth=azimuth, elevation=elevation)

    def toward(self, other: Orbit, share: float) -> Orbit:
        """Return an intermediate view towards another, reached with a share of one."""
        turn = (other.azimuth - self.azimuth + np.pi) % (2.0 * np.pi) - np.pi
        return replace(
            other,
            target=self.target + share * (other.target - self.target),
            azimuth=other.azimuth - (1.0 - share) * turn,
            elevation=self.elevation + share * (other.elevation - self.elevation),
            radius=self.radius * (other.radius / self.radius) ** share,
        )

    def is_like(self, other: Orbit) -> bool:
        """Return whether the two are indistinguishable."""
        return (
            abs(self.azimuth - other.azimuth) + abs(self.elevation - other.elevation) < 1e-6
            and abs(self.radius / other.radius - 1.0) < 1e-6
            and float(np.abs(self.target - other.target).max()) < 1e-6 * self.radius
            and self.up is other.up
        )

    def fitted(self, points: Float, width: float, height: float, margin: float = 1.15) -> Orbit:
        """Return the view from the same side that shows all ``points`` (n, 3)."""
        axes = self.axes()
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        half = 0.5 * (high - low)[:2] * min(width, height) / np.array([width, height])
        target = axes.T @ (0.5 * (low + high))
        return replace(self, target=target, radius=max(margin * float(half.max()), 15.0))


def _cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    """Return the vector product; numpy would take twenty times as long for one."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(vector: Sequence[float]) -> tuple[float, float, float]:
    length = math.sqrt(sum(value * value for value in vector))
    x, y, z = (value / length for value in vector)
    return x, y, z
