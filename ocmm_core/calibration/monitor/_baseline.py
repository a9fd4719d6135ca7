"""Baseline residual map of the monitor, learnt from a waved probe.

The pattern is fixed to its sensor, so residuals at a place are comparable over time if the map is
fine enough. A minute of waving crosses every place many times.

Ridge regression on the residuals of many looks: the pattern is a sum of Gaussian bells with
independent heights on a grid; such a field has the correlation of `camera.rig.SpotNoise`. Heights
are estimated together with the errors of calibration and probe; the poses of looks are eliminated.
Conjugate gradients (M. Hestenes, E. Stiefel, J. Res. NBS 49, 1952) need no matrix of the some ten
thousand unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration.monitor._residual_samples import (
    Belief,
    PatternMap,
    ResidualSample,
    spot_rows,
)
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig, SpotNoise
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Pixels
from ocmm_core.tracking import ProbeBody

_REACH = 3
"""A bell is truncated this many nodes away, at 1 % of its height."""
_BLUR_PX = 0.0007
"""The probe moves during a look, so its mean differs slightly from its middle."""
_TOLERANCE, _MOST_STEPS = 1e-3, 400


@dataclass(frozen=True, slots=True)
class BellGrid:
    """Nodes of one image axis of one camera among all heights."""

    start: int
    columns: int
    rows: int
    """`start`, `columns`, `rows`: Index of its first node, and grid size."""
    step_px: float
    """Node distance, equal to the standard deviation of a bell."""
    height_px: float
    """Scale of a bell with unit coefficient."""

    @classmethod
    def on(cls, camera: CameraModel, noise: SpotNoise, start: int) -> BellGrid:
        """Return the grid of one sensor, with nodes numbered from ``start``."""
        # Independent bells of width s make a field with correlation length s sqrt(2); at this node
        # distance its variance is that of a bell times pi.
        step = noise.pattern_length_px / np.sqrt(2.0)
        columns, rows = (int(size / step) + 2 for size in (camera.width, camera.height))
        return cls(start, columns, rows, step, max(noise.pattern_px, _BLUR_PX) / np.sqrt(np.pi))

    @property
    def part(self) -> slice:
        """Return the slice of its heights."""
        return slice(self.start, self.start + self.columns * self.rows)

    def bells(self, uv: Pixels) -> tuple[Float, Int]:
        """Return the bells at pixels (n, 2) and their node indices, (n, 6, 6)."""
        place = uv / self.step_px
        near = np.floor(place).astype(np.int64)[:, :, None] + np.arange(1 - _REACH, 1 + _REACH)
        high = np.exp(-0.5 * (place[:, :, None] - near) ** 2)
        column = np.clip(near[:, 0], 0, self.columns - 1)
        row = np.clip(near[:, 1], 0, self.rows - 1)
        nodes = self.start + row[:, :, None] * self.columns + column[:, None, :]
        return self.height_px * high[:, 1, :, None] * high[:, 0, None, :], nodes


@dataclass(frozen=True, slots=True)
class PatternFit:
    """Regression of residuals on bell heights, normalised prior errors, and poses.

    Rows: looks by cameras by LEDs by axes; unseen spots have zero weight.
    """

    bells: scipy.sparse.csr_array
    """(K m, nodes): derivative of each residual by each height, px."""
    errors: Float
    """(K m, z): the same for the factor of the belief."""
    factor: Float
    """(14 C + 3 L + 3, z)."""
    residuals: Float
    weights: Float
    """`residuals`, `weights`: (K, m): px, and inverse standard deviation."""
    poses: Float
    """(K, m, 6): orthonormal base of the effect of a look's pose on its weighted residuals."""
    grids: tuple[tuple[BellGrid, BellGrid], ...]

    @classmethod
    def from_samples(cls, looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody) -> PatternFit:
        """Return the regression on looks made without a map."""
        shape = (len(looks), len(rig.cameras), body.n_leds, 2)
        belief = Belief.of_documents(rig, body)
        factor = belief.factor()
        errors = np.zeros((*shape, len(belief.mean)))
        by_pose = np.zeros((*shape, 6))
        residuals, spot_weights = np.zeros(shape), np.zeros(shape)
        row = np.arange(residuals.size).reshape(shape)
        entries: list[tuple[Float, Int, Int]] = []
        grids, start = [], 0
        for c, camera in enumerate(rig.cameras):
            spots = spot_rows(looks, rig, body, c)
            at = (spots.look, c, spots.led)
            by_pose[at], residuals[at] = spots.by_pose, spots.residuals
            spot_weights[at] = 1.0 / np.hypot(spots.white_px, _BLUR_PX)[:, None]
            errors[*at, :, c * N_PARAMETERS : (c + 1) * N_PARAMETERS] = spots.by_camera
            for i in range(3):
                errors[*at, :, len(rig.parameter_covariance) + 3 * spots.led + i] = (
                    spots.by_led[:, :, i]
                )  # fmt: skip
            pair = []
            for axis in range(2):
                grid = BellGrid.on(camera, rig.noise, start)
                start = grid.part.stop
                pair.append(grid)
                heights, nodes = grid.bells(spots.uv)
                rows = np.broadcast_to(row[at][:, axis, None, None], nodes.shape)
                entries.append((heights.ravel(), rows.ravel(), nodes.ravel()))
            grids.append((pair[0], pair[1]))
        values, rows_of, columns = (np.concatenate(part) for part in zip(*entries, strict=True))
        weights = spot_weights.reshape(len(looks), -1)
        weighted = by_pose.reshape(len(looks), -1, 6) * weights[:, :, None]
        # Scale rotations and shifts within each look before orthonormalisation.
        weighted /= np.linalg.norm(weighted, axis=1, keepdims=True)
        places = (rows_of, columns)
        return cls(
            bells=scipy.sparse.csr_array((values, places), shape=(residuals.size, start)),
            errors=errors.reshape(residuals.size, -1) @ factor,
            factor=factor,
            residuals=residuals.reshape(len(looks), -1),
            weights=weights,
            poses=np.linalg.qr(weighted)[0],
            grids=tuple(grids),
        )

    def solve(self, used: NDArray[np.bool_], start: Float | None = None) -> Float:
        """Return heights, then errors, of looks ``used`` (K,); ``start`` halves the steps."""
        nodes = self.bells.shape[1]
        weights = np.where(used[:, None], self.weights, 0.0)
        back = self.bells.T.tocsr()

        def gradient(residuals: Float) -> Float:
            weighted = (self._without_poses(residuals * weights) * weights).ravel()
            return np.concatenate([back @ weighted, self.errors.T @ weighted])

        def normal(x: Float) -> Float:
            return gradient(self.predicted(x)) + x

        size = nodes + self.errors.shape[1]
        operator = scipy.sparse.linalg.LinearOperator((size, size), matvec=normal, dtype=np.float64)
        right = gradient(self.residuals)
        x, _ = scipy.sparse.linalg.cg(operator, right, start, rtol=_TOLERANCE, maxiter=_MOST_STEPS)
        return np.asarray(x, dtype=np.float64)

    def predicted(self, x: Float) -> Float:
        """Return the residuals (K, m), px, from heights and errors."""
        nodes = self.bells.shape[1]
        predicted: Float = self.bells @ x[:nodes] + self.errors @ x[nodes:]
        return predicted.reshape(self.residuals.shape)

    def left_px(self, x: Float, used: NDArray[np.bool_]) -> float:
        """Return the remaining standard deviation, px, beyond white noise."""
        weighted = (self.residuals - self.predicted(x))[used] * self.weights[used]
        rest = weighted - _onto(self.poses[used], weighted)
        seen = self.weights[used] > 0.0
        freedom = int(np.count_nonzero(seen)) - 6 * int(np.count_nonzero(used))
        excess = float(np.sum(rest**2)) / freedom - 1.0
        return float(np.sqrt(max(excess, 0.0)) / np.median(self.weights[used][seen]))

    def belief(self, x: Float) -> Belief:
        """Return the prior of cameras and probe given the heights."""
        weighted = self.errors.reshape(*self.weights.shape, -1) * self.weights[:, :, None]
        information = np.eye(self.factor.shape[1])
        for look, base in zip(weighted, self.poses, strict=True):
            by_pose = base.T @ look
            information += look.T @ look - by_pose.T @ by_pose
        covariance = self.factor @ np.linalg.solve(information, self.factor.T)
        return Belief(
            mean=self.factor @ x[self.bells.shape[1] :],
            covariance=0.5 * (covariance + covariance.T),
        )

    def _without_poses(self, weighted: Float) -> Float:
        return weighted - _onto(self.poses, weighted)


def _onto(base: Float, weighted: Float) -> Float:
    """Return the part of weighted residuals (K, m) in the span of the poses."""
    return (base @ (base.transpose(0, 2, 1) @ weighted[:, :, None]))[:, :, 0]


MIN_LOOKS = 1000
"""20 s of waving in looks of 20 ms; a volume of 400 mm needs more."""

_CELLS_PER_LENGTH = 2.0
"""Between the middles of cells half a length apart, linear interpolation misses 3 % of it."""
_HELD_OUT = 5
"""Every fifth stretch of looks is held out to validate the map."""
_STRETCH = 50
_MOST_LEFT = 0.5
"""Maps that leave more than this share of the pattern are useless."""
_CAUTION = 1.3
"""The remainder is not normal: some places are much worse than most."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """Residuals of the cameras in the unchanged state."""

    maps: tuple[ResidualMap, ...]
    """One for each camera: pattern at the middle of each cell, and number of spots in it."""
    belief: Belief
    """Prior of other camera and probe errors, given these maps."""
    left_px: float
    """Standard deviation of the pattern left by the maps, per axis, from held-out looks."""
    looks: int


def learn_baseline(looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody) -> Baseline:
    """Return residual maps from looks of a waved probe; CalibrationError if too few.

    Of some 20 ms each, made without a map, over all places and attitudes of later measurements.
    """
    if len(looks) < MIN_LOOKS:
        raise CalibrationError(
            "baseline.looks",
            f"{len(looks)} samples of the moving probe are too few to learn the sensor pattern.",
            f"Wave the probe through the whole volume until there are {MIN_LOOKS}.",
        )
    problem = PatternFit.from_samples(looks, rig, body)
    held_out = np.arange(len(looks)) // _STRETCH % _HELD_OUT == _HELD_OUT - 1
    partial = problem.solve(~held_out)
    left_px = problem.left_px(partial, held_out)
    if left_px > _MOST_LEFT * rig.noise.pattern_px:
        raise CalibrationError(
            "baseline.unclear",
            f"{left_px:.4f} px of the sensor pattern remain unexplained.",
            "Wave the probe longer and through the whole volume. If that does not help, verify "
            "the calibration.",
        )
    solution = problem.solve(np.ones(len(looks), dtype=np.bool_), partial)
    maps = tuple(
        _map_of(camera, rig.noise, problem.grids[c], solution, spot_rows(looks, rig, body, c).uv)
        for c, camera in enumerate(rig.cameras)
    )
    return Baseline(maps, problem.belief(solution), left_px, len(looks))


def pattern_maps(rig: Rig, maps: Sequence[ResidualMap], left_px: float) -> tuple[PatternMap, ...]:
    """Return the residual maps of all cameras in the form used by looks.

    ``left_px``: their error at typical spot density; more for fewer spots, up to the whole pattern
    far away. Cells longer than the pattern are useless.
    """
    return tuple(
        _pattern_map(camera, rig.noise, residual_map, left_px)
        for camera, residual_map in zip(rig.cameras, maps, strict=True)
    )


def _pattern_map(
    camera: CameraModel, noise: SpotNoise, residual_map: ResidualMap, left_px: float
) -> PatternMap:
    shape = (residual_map.rows, residual_map.columns)
    cell = np.array([camera.width, camera.height]) / np.array(shape[::-1])
    count = np.array(residual_map.count).reshape(shape)
    mean = np.array([residual_map.mean_u_px, residual_map.mean_v_px])
    whole = noise.pattern_px**2
    left: Float = np.full(shape, whole)
    if float(cell.max()) < noise.pattern_length_px and count.any():
        apart = np.asarray(scipy.ndimage.distance_transform_edt(count == 0, sampling=cell[::-1]))
        beyond = np.maximum(apart - cell.max(), 0.0) / noise.pattern_length_px
        # Spots within the pattern length contribute, near ones most.
        reach = noise.pattern_length_px / np.sqrt(2.0) / cell[::-1]
        density = np.asarray(scipy.ndimage.gaussian_filter(count.astype(np.float64), reach))
        typical = np.median(np.repeat(density.ravel(), count.ravel()))
        fewer = np.maximum(typical / np.maximum(density, 1e-9), 1.0)
        here = np.minimum((_CAUTION * left_px) ** 2 * fewer, whole)
        left = np.minimum(here + whole * (1.0 - np.exp(-(beyond**2))), whole)
    return PatternMap(cell, mean.reshape(2, *shape).transpose(1, 2, 0), np.sqrt(left))


def _map_of(
    camera: CameraModel,
    noise: SpotNoise,
    pair: tuple[BellGrid, BellGrid],
    heights: Float,
    uv: Pixels,
) -> ResidualMap:
    size = np.array([camera.width, camera.height])
    columns, rows = np.ceil(size * _CELLS_PER_LENGTH / noise.pattern_length_px).astype(int)
    cell = size / np.array([columns, rows])
    u, v = (np.arange(columns) + 0.5) * cell[0], (np.arange(rows) + 0.5) * cell[1]
    places = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    means = []
    for grid in pair:
        bells, nodes = grid.bells(places)
        means.append(np.round(np.sum(bells * heights[nodes], axis=(1, 2)), 6))
    at = np.floor(uv / cell).astype(np.int64)
    count = np.bincount(at[:, 1] * columns + at[:, 0], minlength=rows * columns)
    return ResidualMap(
        columns=int(columns),
        rows=int(rows),
        mean_u_px=tuple(means[0].tolist()),
        mean_v_px=tuple(means[1].tolist()),
        count=tuple(count.tolist()),
    )
