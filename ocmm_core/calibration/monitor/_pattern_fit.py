"""Estimate the sensor patterns by ridge regression on the residuals of many looks.

The pattern is a sum of Gaussian bells with independent heights on a grid: such a field has the
correlation of `camera.rig.SpotNoise`. Heights are estimated together with the errors of calibration
and probe; the poses of looks are eliminated. Conjugate gradients (M. Hestenes, E. Stiefel, J. Res.
NBS 49, 1952) need no matrix of the some ten thousand unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, cg

from ocmm_core.calibration.monitor._drift_design_matrix import Belief, spot_rows
from ocmm_core.calibration.monitor._residual_samples import ResidualSample
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig, SpotNoise
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

    bells: csr_array
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
    def of(cls, looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody) -> PatternFit:
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
        return cls(
            bells=csr_array((values, (rows_of, columns)), shape=(residuals.size, start)),
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
        operator = LinearOperator((size, size), matvec=normal, dtype=np.float64)
        x, _ = cg(operator, gradient(self.residuals), start, rtol=_TOLERANCE, maxiter=_MOST_STEPS)
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
    part: Float = (base @ (base.transpose(0, 2, 1) @ weighted[:, :, None]))[:, :, 0]
    return part
