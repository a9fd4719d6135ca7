"""The parts of `benchmarks.decisions`: features, touches without error, and characteristics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ocmm_core.alignment import AnyAlignment, BoundAlignment, DatumAlignment
from ocmm_core.features.shapes import NominalFeature, Shape, nominal_geometry
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.zones import Association, Characteristic

TIP = 1.5
WHITE_MM, PLACE_MM, SCALE, RADIUS_MM = 0.004, 0.006, 1e-5, 0.001
"""Errors of each point, of all points together, of lengths, and of the ball."""

GROUPS = ("sizes and places", "forms", "zones about datums")

T_WORLD_FROM_PART = RigidTransform(
    rotation_from_vector(np.array([0.4, -0.7, 1.1])), np.array([120.0, -80.0, 950.0])
)
_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Group:
    """One kind of part.

    Attributes
    ----------
    features, characteristics, alignment
        As in a plan.
    points, normals
        Touches without error, and the surface's normals (N, 3) there, world.
    covariance
        (3 N + 1, 3 N + 1) of the errors.
    share
        Share of this kind among all results.
    """

    features: tuple[NominalFeature, ...]
    characteristics: tuple[Characteristic, ...]
    alignment: AnyAlignment
    points: tuple[MeasuredPoint, ...]
    normals: Float
    covariance: Float
    share: float


class _Builder:
    """Gathers features with their touches, in the part frame."""

    def __init__(self) -> None:
        self.features: list[NominalFeature] = []
        self.points: list[MeasuredPoint] = []

    def plane(
        self, name: str, at: Sequence[float], normal: Sequence[float] = _Z, size: float = 30.0
    ) -> None:
        """Add a square plane of nine points."""
        n = unit(np.array(normal))
        u = unit(np.cross(n, [0.3, 1.0, 0.2]))
        v = np.cross(n, u)
        grid = [a * u + b * v for a in (-size, 0.0, size) for b in (-size, 0.0, size)]
        surface = np.array(at) + np.array(grid)
        self._add(name, Shape.PLANE, at, normal, 0.0, "outer", surface, np.tile(n, (9, 1)))

    def ring(
        self, name: str, at: Sequence[float], diameter: float, side: str, n: int,
        projection: str = "",
    ) -> None:  # fmt: skip
        """Add a circle square to z."""
        turn = 2.0 * np.pi * np.arange(n) / n + 0.3
        normals = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
        surface = np.array(at) + 0.5 * diameter * normals
        self._add(name, Shape.CIRCLE, at, _Z, diameter, side, surface, normals, projection)

    def cylinder(self, name: str, at: Sequence[float], diameter: float, height: float) -> None:
        """Add a shaft along z, probed at three heights of five points."""
        turn = 2.0 * np.pi * np.arange(15) / 5 + 0.4 * (np.arange(15) // 5)
        normals = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(15)])
        heights = np.repeat([-0.5, 0.0, 0.5], 5)[:, None] * height * np.array(_Z)
        surface = np.array(at) + 0.5 * diameter * normals + heights
        self._add(name, Shape.CYLINDER, at, _Z, diameter, "outer", surface, normals, length=height)

    def ball(self, name: str, at: Sequence[float], diameter: float, off: float = 0.0) -> None:
        """Add a ball of twelve points displaced by ``off`` along x."""
        place = 2.399963 * np.arange(12)
        height = np.linspace(-0.25, 1.0, 12)
        ring = np.sqrt(1.0 - height**2)
        normals = np.column_stack([ring * np.cos(place), ring * np.sin(place), height])
        surface = np.array(at) + 0.5 * diameter * normals + np.array([off, 0.0, 0.0])
        self._add(name, Shape.SPHERE, at, _Z, diameter, "outer", surface, normals)

    def edge(self, name: str, at: Sequence[float], length: float) -> None:
        """Add a straight edge along x, probed from -y."""
        along = np.linspace(-0.5, 0.5, 7)[:, None] * length * np.array([1.0, 0.0, 0.0])
        self._add(
            name, Shape.LINE, at, (1.0, 0.0, 0.0), 0.0, "outer", np.array(at) + along,
            np.tile([0.0, -1.0, 0.0], (7, 1)),
        )  # fmt: skip

    def _add(
        self, name: str, shape: Shape, at: Sequence[float], direction: Sequence[float],
        diameter: float, side: str, surface: Float, normals: Float, projection: str = "",
        length: float = 0.0,
    ) -> None:  # fmt: skip
        x, y, z = at
        a, b, c = direction
        self.features.append(
            NominalFeature(
                name=name, shape=shape, points=len(surface), point=(x, y, z), direction=(a, b, c),
                diameter=diameter, side="inner" if side == "inner" else "outer",
                projection=projection, length=length,
            )
        )  # fmt: skip
        outward = -normals if side == "inner" else normals
        tips = T_WORLD_FROM_PART.apply(surface + TIP * outward)
        sides = outward @ T_WORLD_FROM_PART.rotation.T
        for tip, direction_world in zip(tips, sides, strict=True):
            number = len(self.points) + 1
            self.points.append(
                MeasuredPoint(
                    number=number, feature=name, time_s=float(number), first_frame=0, last_frame=9,
                    n_frames=10, tip_world=tip, random_covariance=WHITE_MM**2 * np.eye(3),
                    direction=direction_world, tip_radius=TIP, rotation_world_from_probe=np.eye(3),
                    spots=np.full((2, 4, 2), np.nan), chi2_per_dof=1.0, approach="nominal",
                )
            )  # fmt: skip

    def group(self, asked: Sequence[Characteristic], share: float) -> Group:
        """Return the group."""
        rule = DatumAlignment(primary="top", secondary=("a", "b"), origin="a")
        shapes = {item.name: item.shape for item in self.features}
        nominals = {item.name: nominal_geometry(item) for item in self.features}
        tips = np.array([point.tip_world for point in self.points])
        n = len(tips)
        covariance = np.zeros((3 * n + 1, 3 * n + 1))
        places = (tips - tips.mean(axis=0)).ravel()
        covariance[:-1, :-1] = PLACE_MM**2 * np.kron(np.ones((n, n)), np.eye(3))
        covariance[:-1, :-1] += SCALE**2 * np.outer(places, places)
        covariance[:-1, :-1] += WHITE_MM**2 * np.eye(3 * n)
        covariance[-1, -1] = RADIUS_MM**2
        return Group(
            tuple(self.features), tuple(asked), BoundAlignment(rule, shapes, nominals),
            tuple(self.points), np.array([point.direction for point in self.points]), covariance,
            share,
        )  # fmt: skip


@cache
def group_of(name: str) -> Group:
    """Return the group called ``name``."""
    build = _Builder()
    build.plane("top", (30.0, 0.0, 0.0))
    build.ring("a", (0.0, 0.0, -3.0), 12.0, "inner", 7, "top")
    build.ring("b", (60.0, 0.0, -3.0), 8.0, "inner", 7, "top")
    if name == GROUPS[0]:
        build.ball("ball", (25.0, 40.0, 30.0), 20.0)
        build.ball("off", (-25.0, 40.0, 30.0), 20.0, off=0.05)
        build.cylinder("pin", (90.0, 0.0, 15.0), 16.0, 20.0)
        build.plane("slope", (0.0, -80.0, 20.0), (0.0, -0.5, 0.866))
        return build.group(
            [
                asked("diameter of a bore", "diameter", ["a"]),
                asked("diameter of a ball", "diameter", ["ball"]),
                asked("diameter of a shaft", "diameter", ["pin"]),
                asked("distance of bores", "distance", ["a", "b"]),
                asked("height of a ball", "distance", ["ball", "top"]),
                asked("coordinate", "coordinate", ["ball"], axis="x"),
                asked("angle", "angle", ["slope", "top"]),
                asked("position, true", "position", ["ball"]),
                asked("position, 0.1 off", "position", ["off"]),
            ],
            0.7,
        )
    if name == GROUPS[1]:
        build.ring("free", (0.0, 90.0, 5.0), 30.0, "outer", 12)
        build.ball("ball", (25.0, 40.0, 30.0), 20.0)
        build.edge("edge", (30.0, -40.0, 0.0), 60.0)
        build.cylinder("pin", (90.0, 0.0, 15.0), 16.0, 20.0)
        return build.group(
            [
                asked("flatness, LS", "flatness", ["top"], "least squares"),
                asked("flatness, MZ", "flatness", ["top"]),
                asked("roundness, LS", "roundness", ["free"], "least squares"),
                asked("roundness, MZ", "roundness", ["free"]),
                asked("form of a ball, LS", "form", ["ball"], "least squares"),
                asked("straightness", "straightness", ["edge"]),
                asked("cylindricity, LS", "cylindricity", ["pin"], "least squares"),
                asked("two-point maximum", "diameter", ["free"], "two-point maximum"),
                asked("two-point mean", "diameter", ["free"], "two-point mean"),
            ],
            0.2,
        )
    build.plane("step", (30.0, 80.0, 20.0))
    build.cylinder("pin", (90.0, 0.0, 15.0), 16.0, 20.0)
    build.plane("slope", (0.0, -80.0, 20.0), (0.0, -0.5, 0.866))
    build.cylinder("upper", (90.0, 0.0, 45.0), 12.0, 20.0)
    build.ring("shoulder", (90.0, 0.0, 60.0), 30.0, "outer", 12)
    build.ball("ball", (25.0, 40.0, 30.0), 20.0)
    return build.group(
        [
            asked("parallelism", "parallelism", ["step"], datums=["top"]),
            asked("perpendicular axis", "perpendicularity", ["pin"], datums=["top"]),
            asked("position about datums", "position", ["ball"], datums=["top", "a", "b"]),
            asked("position of a face", "position", ["step"], datums=["top"]),
            asked("angularity", "angularity", ["slope"], datums=["top"]),
            asked("concentricity", "concentricity", ["shoulder"], datums=["pin"]),
            asked("coaxiality", "coaxiality", ["upper"], datums=["pin"]),
            asked("surface profile", "surface profile", ["step"], datums=["top"]),
            asked("circular runout", "circular runout", ["shoulder"], datums=["pin"]),
            asked("total runout", "total runout", ["upper"], datums=["pin"]),
        ],
        0.1,
    )


def asked(
    name: str, kind: str, features: list[str], association: Association = "", *,
    axis: str = "", datums: Sequence[str] = (),
) -> Characteristic:  # fmt: skip
    """Return a characteristic; its limits are put elsewhere."""
    return Characteristic(
        name=name, kind=kind, features=features, upper=1.0, association=association,
        axis="x" if axis == "x" else "", datums=list(datums),
    )  # fmt: skip
