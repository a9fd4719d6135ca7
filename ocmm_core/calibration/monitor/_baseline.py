"""Baseline residual map of the monitor, learnt from a waved probe.

The pattern is fixed to its sensor, so residuals at a place are comparable over time if the map is
fine enough. A minute of waving crosses every place many times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ocmm_core.calibration.monitor._drift_design_matrix import Belief, spot_rows
from ocmm_core.calibration.monitor._pattern_fit import BellGrid, PatternFit
from ocmm_core.calibration.monitor._residual_samples import PatternMap, ResidualSample
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.camera import CameraModel, Rig, SpotNoise
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels
from ocmm_core.tracking import ProbeBody

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
    problem = PatternFit.of(looks, rig, body)
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
        apart = np.asarray(distance_transform_edt(count == 0, sampling=cell[::-1]))
        beyond = np.maximum(apart - cell.max(), 0.0) / noise.pattern_length_px
        # Spots within the pattern length contribute, near ones most.
        reach = noise.pattern_length_px / np.sqrt(2.0) / cell[::-1]
        density = np.asarray(gaussian_filter(count.astype(np.float64), reach))
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
