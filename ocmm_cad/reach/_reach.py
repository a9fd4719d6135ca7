"""Targets that can be touched, with an attitude each, and obstacles of the others.

The mesh of the part is an obstacle itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_cad.reach import _search_kernel as kernel
from ocmm_cad.reach._setting import Setting, attitudes, handle_directions
from ocmm_core.calibration.probe_design import leds_behind_body
from ocmm_core.geometry import Float, Int

_LONG, _MORE = 2.0, 0.25
"""Edges longer than this multiple of the median are halved; limit of added triangles, relative."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """Mesh of a part and its tree of boxes."""

    triangles: Float
    """(n, 3, 3), mm, frame of the part; very long ones are divided."""
    faces: Int
    """(n,): face of each, from 0."""
    n_faces: int
    deflection_mm: float
    """mm: bound of the distance of the mesh from the faces."""
    boxes: Float
    links: Int
    order: Int
    """`boxes`, `links`, `order`: See `_search_kernel.grow`."""

    @property
    def middle(self) -> Float:
        """Return the middle of the part's bounding box, (3,), mm."""
        middle: Float = 0.5 * (self.boxes[0, :3] + self.boxes[0, 3:])
        return middle


def make_obstacle(triangles: Float, faces: Int, n_faces: int, deflection_mm: float) -> Obstacle:
    """Return a part as an obstacle.

    `triangles`: (n, 3, 3), mm, n > 0. `faces`: (n,), from 0, less than `n_faces`. `deflection_mm`:
    bound of the distance of the mesh from the faces.
    """
    # Read-only arrays, e.g. from a pipe, are another type to the compiler: it would recompile all
    # loops, which takes longer than thousands of queries.
    triangles = np.require(triangles, np.float64, ("C", "W"))
    faces = np.require(faces, np.int64, ("C", "W"))
    triangles, faces = _without_long(triangles, faces)
    n = len(triangles)
    boxes, links = np.empty((2 * n, 6)), np.empty((2 * n, 2), dtype=np.int64)
    order = np.empty(n, dtype=np.int64)
    count = kernel.grow(triangles, boxes, links, order)
    return Obstacle(
        triangles, faces, n_faces, deflection_mm, boxes[:count].copy(), links[:count].copy(), order
    )


def _without_long(triangles: Float, faces: Int) -> tuple[Float, Int]:
    """Return triangles with the longest ones divided, and the face of each.

    A face with thousands of holes has triangles as long as the part, so that every near body would
    be tested against all in their leaf.
    """
    longest = _longest(triangles)
    least = _LONG * float(np.median(longest))
    most = int((1.0 + _MORE) * len(triangles))
    limit = 0.5 * float(longest.max())
    while limit > least:
        while (long := longest > limit).any():
            if len(triangles) + int(long.sum()) > most:
                return triangles, faces
            halves = _halved(triangles[long])
            triangles = np.concatenate([triangles[~long], halves])
            longest = np.concatenate([longest[~long], _longest(halves)])
            faces = np.concatenate([faces[~long], np.tile(faces[long], 2)])
        limit *= 0.5
    return triangles, faces


def _longest(triangles: Float) -> Float:
    edges = triangles - triangles[:, [1, 2, 0]]
    found: Float = np.sqrt((edges * edges).sum(axis=2).max(axis=1))
    return found


def _halved(triangles: Float) -> Float:
    """Return both halves of triangles, cut at the middle of the longest edge; (2 n, 3, 3)."""
    edges = triangles - triangles[:, [1, 2, 0]]
    first = (edges * edges).sum(axis=2).argmax(axis=1)
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (first + turn) % 3] for turn in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


LEAST_LEDS = 4
"""Required for identification."""
WAYS_MM = (8.0, 4.0, 2.0, 1.0, 0.5, 0.2)
"""Tried straight ways along the normal; the longest free one is used."""
_STEP_MM = 2.0
_BALL_GAP_MM = 0.05
"""Clearance of the ball from other faces, in addition to the deflection of the mesh."""
_STYLUS_GAP_MM, _BODY_GAP_MM = 1.0, 3.0
"""Clearances, by the accuracy of a hand."""
_SMALL_BALL = 0.2
"""Clearance of the stylus of a small ball, relative to its radius: it is as near to the surface."""
_EMISSION_MARGIN = np.radians(3.0)
_OUTSIDE, _LEANING = 5, 6
_LEAN_GAIN = 0.32
"""Share of the normal's angle from the vertical by which the handle leans."""
_UPRIGHT_GAIN = 0.15
_OFF_AXIS, _SKIMMING = np.radians(50.0), np.sin(np.radians(-2.0))


@dataclass(frozen=True, slots=True, eq=False)
class Reached:
    stage: Int
    """(n,): 0 if a target can be touched and is seen, else the kind of obstacle."""
    face: Int
    """(n,): the face that would be touched, from 0; -1 for none."""
    turns_part_from_probe: Float
    """(n, 3, 3): attitude of the probe; NaN if unreachable."""
    ways_mm: Float
    """(n,): free along the normal."""
    leds: Int
    """(n,): number of LEDs seen by two cameras."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceTargets:
    """Queried targets on one surface."""

    points: Float
    normals: Float
    """`points`, `normals`: (n, 3), mm and unit, out of the material."""
    own: Sequence[int]
    """Faces of the surface, from 0; disjoint between simultaneous queries."""
    axis_part: Float | None = None
    """(3,), unit: of their bore; None outside."""


class Reach:
    """Queries of one part: does the probe reach targets, and do the cameras see it.

    `ball_radius`: mm. `setting`: None for the ball alone. `axes_part`: (m, 3), unit, of bores, into
    which the handle may be held along.
    """

    def __init__(
        self, obstacle: Obstacle, ball_radius: float, setting: Setting | None, axes_part: Float
    ) -> None:
        self._obstacle, self._radius, self._setting = obstacle, ball_radius, setting
        self._limits = np.zeros(kernel.N_LIMITS)
        self._limits[kernel.BALL_GAP] = obstacle.deflection_mm + _BALL_GAP_MM
        # The triangles of a concave face lie inside: nearer to the ball by the deflection.
        self._limits[kernel.OWN_GAP] = -(obstacle.deflection_mm + 1e-3)
        slim = min(_STYLUS_GAP_MM, _SMALL_BALL * ball_radius)
        self._limits[kernel.STYLUS_GAP] = slim + obstacle.deflection_mm
        self._limits[kernel.BODY_GAP] = _BODY_GAP_MM + obstacle.deflection_mm
        self._limits[kernel.STEP] = _STEP_MM
        self._limits[kernel.LEAST_LEDS] = LEAST_LEDS
        self._turns, self._handles = np.empty((0, 1, 3, 3)), np.empty((0, 3))
        self._solid, self._leds = np.empty((0, 14)), np.empty((0, 3))
        self._cameras, self._sensors = np.empty((0, 21)), np.empty((0, 2))
        self._looks = np.empty((0, 3))
        if setting is not None:
            self._prepare(setting, axes_part)

    def _prepare(self, setting: Setting, axes_part: Float) -> None:
        pose = setting.pose(self._obstacle.middle)
        self._pose = pose
        both = np.concatenate([axes_part, -axes_part]) @ pose.rotation.T
        handles = handle_directions(setting.tilt_deg, both)
        turns = attitudes(setting, handles, pose.apply(self._obstacle.middle))
        allowed = np.isfinite(turns[:, 0, 0, 0])
        handles, turns = handles[allowed], turns[allowed]
        # An attitude excluded by a rule is replaced by the first one.
        turns = np.where(np.isfinite(turns), turns, turns[:, :1])
        self._handles = handles
        self._turns = np.ascontiguousarray(pose.rotation.T @ turns)
        self._solid = setting.solid()
        # LEDs hidden behind the probe's body do not count.
        hidden = () if setting.design is None else leds_behind_body(setting.body, setting.design)
        shown = [n for n in range(len(setting.body.leds_probe)) if n not in hidden]
        self._leds = setting.body.leds_probe[shown] - setting.body.tip_probe
        self._looks = setting.body.led_directions_probe[shown]
        half = max(setting.body.emission_half_angle - _EMISSION_MARGIN, 0.0)
        self._limits[kernel.COS_EMISSION] = np.cos(half)
        if setting.rig is not None:
            seen = [
                replace(camera, T_camera_from_world=camera.T_camera_from_world.compose(pose))
                for camera in setting.rig.cameras
            ]
            self._cameras = np.stack([camera.packed() for camera in seen])
            self._sensors = np.array([[c.width - 1.0, c.height - 1.0] for c in seen])

    def evaluate(
        self, points: Float, normals: Float, own: Sequence[int], axis_part: Float | None = None
    ) -> Reached:
        """Return the result of targets on one surface, see `SurfaceTargets`."""
        (found,) = self.of_each([SurfaceTargets(points, normals, own, axis_part)])
        return found

    def of_each(self, asked: Sequence[SurfaceTargets]) -> list[Reached]:
        """Return the results per surface; one call for thousands."""
        if not asked:
            return []
        points = np.concatenate([one.points for one in asked])
        normals = np.concatenate([one.normals for one in asked])
        surfaces = np.full(self._obstacle.n_faces, -1, dtype=np.int64)
        for number, one in enumerate(asked):
            surfaces[one.own] = number
        counts = [len(one.points) for one in asked]
        own = np.repeat(np.arange(len(asked)), counts)
        every = self._of_all(points, normals, surfaces, own, self._all_ranks(asked))
        ends = np.cumsum(counts).tolist()
        return [
            Reached(
                every.stage[start:end], every.face[start:end],
                every.turns_part_from_probe[start:end], every.ways_mm[start:end],
                every.leds[start:end],
            )
            for start, end in zip([0, *ends], ends, strict=False)
        ]  # fmt: skip

    def _of_all(
        self, points: Float, normals: Float, surfaces: Int, own: Int, ranks: Int
    ) -> Reached:
        count = len(points)
        found, ways = np.zeros((count, 5), dtype=np.int64), np.zeros(count)
        part = self._obstacle
        # Targets outside the volume are not searched: most, for a part larger than it.
        outside = self._outside(points, normals)
        inside = np.flatnonzero(~outside)
        inner, way_of = found[inside], ways[inside]
        kernel.search(
            np.ascontiguousarray(points[inside]), np.ascontiguousarray(normals[inside]),
            self._radius, np.array(WAYS_MM), self._turns, ranks[inside], self._solid,
            self._leds, self._looks, self._cameras, self._sensors, self._limits, part.triangles,
            part.faces, surfaces, own[inside], part.boxes, part.links, part.order, inner, way_of,
        )  # fmt: skip
        found[inside], ways[inside] = inner, way_of
        found[outside, 1] = -1
        stage = np.where(outside, _OUTSIDE, found[:, 0])
        if self._setting is not None:
            stage[(ranks[:, 0] < 0) & (found[:, 1] < 0)] = _LEANING
        held = np.full((count, 3, 3), np.nan)
        if len(self._turns):
            good = stage == kernel.FOUND
            held[good] = self._turns[found[good, 2], found[good, 3]]
        return Reached(stage, found[:, 1], held, ways, found[:, 4])

    def _outside(self, points: Float, normals: Float) -> NDArray[np.bool_]:
        if self._setting is None or self._setting.rig is None:
            return np.zeros(len(points), dtype=np.bool_)
        centres = self._pose.apply(points + self._radius * normals)
        low, high = self._setting.rig.volume_world
        outside: NDArray[np.bool_] = ((centres < low) | (centres > high)).any(axis=1)
        return outside

    def _all_ranks(self, asked: Sequence[SurfaceTargets]) -> Int:
        """Return `_ranks` of all; at once without handles, as for most large models."""
        if not len(self._handles):
            return np.full((sum(len(one.points) for one in asked), 1), -1, dtype=np.int64)
        every = [self._ranks(one.normals, one.axis_part) for one in asked]
        ranks = np.full(
            (sum(map(len, every)), max(one.shape[1] for one in every)), -1, dtype=np.int64
        )
        start = 0
        for one in every:
            ranks[start : start + len(one), : one.shape[1]] = one
            start += len(one)
        return ranks

    def _ranks(self, normals: Float, axis_part: Float | None) -> Int:
        """Return for each target the directions of the handle, (n, d), the most natural first."""
        handles = self._handles
        world = normals @ self._pose.rotation.T
        if axis_part is not None:
            axis = self._pose.rotation @ axis_part
            likes = np.abs(handles @ axis)[None].repeat(len(normals), axis=0)
        else:
            level = np.hypot(world[:, 0], world[:, 1])
            lean = _LEAN_GAIN * np.arctan2(level, world[:, 2])
            flat = world[:, :2] / np.maximum(level, 1e-9)[:, None]
            likes = np.column_stack([np.sin(lean)[:, None] * flat, np.cos(lean)]) @ handles.T
        cost = np.arccos(np.clip(likes, -1.0, 1.0))
        # A probe cannot come from below a surface, nor far off the axis of a bore.
        far = cost > _OFF_AXIS if axis_part is not None else world @ handles.T < _SKIMMING
        cost = cost + _UPRIGHT_GAIN * np.arccos(np.clip(handles[:, 2], -1.0, 1.0))
        ranks = np.argsort(np.where(far, np.inf, cost), axis=1, kind="stable")
        ranks[np.arange(ranks.shape[1]) >= (~far).sum(axis=1)[:, None]] = -1
        return np.ascontiguousarray(ranks[:, : max(1, int((~far).sum(axis=1).max()))])

    def why_not(self, reached: Reached) -> str:
        """Return the most frequent obstacle."""
        against = reached.stage != kernel.FOUND
        if not against.any():
            return ""
        pairs = zip(reached.stage[against].tolist(), reached.face[against].tolist(), strict=True)
        (stage, face), _ = Counter(pairs).most_common(1)[0]
        if stage == _OUTSIDE:
            return "it is outside the measuring volume where the part stands"
        if stage == _LEANING:
            return "the probe would have to be held from below, or against its orientation rules"
        if stage == kernel.SIGHT:
            most = int(reached.leds[reached.stage == kernel.SIGHT].max())
            return f"two cameras see {most} LEDs of the probe there, {LEAST_LEDS} are needed"
        what = {kernel.BALL: "ball", kernel.STYLUS: "stylus", kernel.BODY: "body of the probe"}
        return f"the {what[stage]} would touch face {face + 1}"
