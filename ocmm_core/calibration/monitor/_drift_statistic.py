"""Likelihood that looks show a change of a camera, the probe, or the part's place.

Residuals of looks are modelled by effects present without any change (poses, uncertain calibration
and probe, sensor pattern, white noise); the generalised likelihood ratio tests "this has changed by
an unknown amount" against "nothing has". The pattern enters with its covariance over the sensor, so
a resting probe adds no certainty over time. A floor common to all looks of one LED in one camera
represents unmodelled effects. All changes are of first order: with calibration and probe as prior,
the score test in a linear normal model (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.calibration.monitor._residual_samples import (
    Belief,
    ResidualSample,
    SpotRows,
    spot_rows,
    spot_weights,
    tips_world,
)
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig
from ocmm_core.geometry import Float, skew
from ocmm_core.tracking import ProbeBody

_UNITS = np.array([1e-5] * 3 + [0.01] * 3 + [1e-3] + [0.01] * 2)
"""Relevant sizes of changes, for numerical scaling."""
_LED_UNIT = 0.01
_BOUND = 1e3
"""Largest change in units; regularises changes that some looks cannot separate."""


CAMERA_CHANGES = (
    "pitch", "yaw", "roll", "sideways", "vertical", "axial", "focal length",
    "principal point u", "principal point v",
)  # fmt: skip
"""Possible changes of a camera: rotations (rad) about its axes through its projection centre (x to
the right of the image, y down it, z along the view), shifts (mm) of that centre along them, focal
length (mm) and principal point (px)."""

N_MOTIONS = 6
"""The first of them are motions."""


@dataclass(frozen=True, slots=True)
class PossibleChange:
    """One possible change."""

    score: float
    """Twice the logarithm of the likelihood ratio; chi-square (``dof``) without a change."""
    dof: int
    size: Float
    """(dof,): most likely amount."""
    covariance: Float
    """(dof, dof): of the amount."""


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of all possible changes."""

    chi2: float
    dof: int
    """`chi2`, `dof`: Chi-square of the residuals beyond effects present without any change."""
    cameras: tuple[PossibleChange, ...]
    """Change of each camera, sizes in the order of `CAMERA_CHANGES`."""
    motions: tuple[PossibleChange, ...]
    lenses: tuple[PossibleChange, ...]
    """`motions`, `lenses`: The same, for the first six of these alone and for the others alone."""
    axes: Float
    """(C, 9): score of each of these changes alone."""
    axis_sizes: Float
    """(C, 9): most likely amount of each of them alone."""
    leds: tuple[PossibleChange, ...]
    """Change of the place of each LED in the probe frame, (3,), mm."""
    common: PossibleChange | None
    """Motion of all cameras together against the reference places of the ball: a rotation (rad)
    about the world origin, then a shift (mm), both of the places; None without reference places."""


def score_changes(
    looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody, belief: Belief, floor_px: float,
    pixel_px: float = 0.0,
) -> Scores:  # fmt: skip
    """Return the scores of changes since the calibration, from at least one look.

    ``belief``: errors of rig and probe then. ``floor_px``: constant error of one LED in one camera,
    per axis; ``pixel_px``: error fixed to the pixels (`PixelNoise`).
    """
    system = _System.from_samples(looks, rig, body, belief, floor_px, pixel_px)
    normal = system.without_poses()
    n_poses = system.blocks["poses"].stop
    first_of = {name: block.start - n_poses for name, block in system.blocks.items()}
    nuisance = slice(first_of["cameras"], first_of["common"])
    # Uncertain calibration and probe in units of their prior: x = factor z, z ~ N(0, 1).
    factor = belief.factor()
    inner = factor.T @ normal[nuisance, nuisance] @ factor + np.eye(factor.shape[1])
    outer = normal[:, nuisance] @ factor
    marginal = normal - outer @ scipy.linalg.cho_solve(scipy.linalg.cho_factor(inner), outer.T)

    def change(first: int, columns: Float, units: Float) -> PossibleChange:
        rows = slice(first, first + len(columns))
        scaled = columns * units
        information = scaled.T @ marginal[rows, rows] @ scaled
        return _change(information, scaled.T @ marginal[rows, -1], units)

    cameras, motions, lenses = [], [], []
    axes, axis_sizes = [], []
    for c, camera in enumerate(rig.cameras):
        first = first_of["cameras"] + c * N_PARAMETERS
        columns = camera_changes(camera)
        cameras.append(change(first, columns, _UNITS))
        motions.append(change(first, columns[:, :N_MOTIONS], _UNITS[:N_MOTIONS]))
        lenses.append(change(first, columns[:, N_MOTIONS:], _UNITS[N_MOTIONS:]))
        # Each parameter alone: 1 by 1, all at once.
        scaled, rows = columns * _UNITS, slice(first, first + len(columns))
        information = np.sum(scaled * (marginal[rows, rows] @ scaled), axis=0)
        score = scaled.T @ marginal[rows, -1]
        size = score / (information + 1.0 / _BOUND**2)
        axes.append(score * size)
        axis_sizes.append(size * _UNITS)
    place = np.full(3, _LED_UNIT)
    common = None
    if system.anchored:
        common = change(first_of["common"], np.eye(N_MOTIONS), _UNITS[:N_MOTIONS])
    return Scores(
        chi2=float(marginal[-1, -1]),
        dof=system.rows - 6 * len(looks),
        cameras=tuple(cameras),
        motions=tuple(motions),
        lenses=tuple(lenses),
        axes=np.array(axes),
        axis_sizes=np.array(axis_sizes),
        leds=tuple(
            change(first_of["probe"] + 3 * led, np.eye(3), place) for led in range(body.n_leds)
        ),
        common=common,
    )


@dataclass(frozen=True, slots=True)
class _System:
    """Normal equations of all unknowns, the residuals as last column.

    Unknowns: 6 for the pose of each look (rotation about the ball, its shift), 14 for each camera,
    the probe as in `ProbeBody.geometry_covariance`, 6 for the common motion.
    """

    normal: Float
    blocks: dict[str, slice]
    rows: int
    anchored: bool

    @classmethod
    def from_samples(
        cls,
        looks: Sequence[ResidualSample],
        rig: Rig,
        body: ProbeBody,
        belief: Belief,
        floor_px: float,
        pixel_px: float,
    ) -> _System:
        sizes = {
            "poses": 6 * len(looks),
            "cameras": N_PARAMETERS * len(rig.cameras),
            "probe": 3 * body.n_leds + 3,
            "common": 6,
        }
        ends = np.cumsum(list(sizes.values())).tolist()
        blocks = {
            name: slice(end - size, end)
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }
        width = ends[-1] + 1
        normal = np.zeros((width, width))
        rows = 0
        for c in range(len(rig.cameras)):
            spots = spot_rows(looks, rig, body, c)
            weights = spot_weights(spots, rig.noise.pattern_length_px, floor_px, pixel_px)
            _add_camera(normal, spots, weights, c, blocks)
            rows += 2 * len(spots.look)
        anchored = False
        for k, look in enumerate(looks):
            if look.known_tip_world is None or look.known_tip_covariance is None:
                continue
            anchored = True
            whitened = _anchor_rows(look, body, k, blocks, width)
            normal += whitened.T @ whitened
            rows += len(whitened)
        # Subtract the prior mean from the residuals: y - X mean, in the normal equations.
        known = slice(blocks["cameras"].start, blocks["probe"].stop)
        normal[:, -1] -= normal[:, known] @ belief.mean
        normal[-1] -= belief.mean @ normal[known]
        return cls(normal, blocks, rows, anchored)

    def without_poses(self) -> Float:
        poses = self.blocks["poses"]
        scale = 1.0 / np.sqrt(np.diag(self.normal)[poses])
        own = self.normal[poses, poses] * np.outer(scale, scale)
        others = self.normal[poses, poses.stop :] * scale[:, None]
        rest = self.normal[poses.stop :, poses.stop :]
        of_poses = scipy.linalg.cho_solve(scipy.linalg.cho_factor(own), others)
        return rest - others.T @ of_poses


def _add_camera(
    normal: Float, spots: SpotRows, weights: Float, c: int, blocks: dict[str, slice]
) -> None:
    """Add the spots of one camera; sparse pose columns are four times faster than dense ones."""
    n = len(spots.look)
    first = blocks["cameras"].start + c * N_PARAMETERS
    probe = blocks["probe"]
    columns = np.concatenate(
        [np.arange(first, first + N_PARAMETERS), np.arange(probe.start, probe.stop), [-1]]
    )
    poses = blocks["poses"]
    unknowns = (6 * spots.look[:, None] + np.arange(6)).ravel()
    ends = np.arange(0, 6 * n + 1, 6)
    dense = np.zeros((2, n, len(columns)))
    dense[:, :, :N_PARAMETERS] = spots.by_camera.transpose(1, 0, 2)
    for i in range(3):
        dense[:, np.arange(n), N_PARAMETERS + 3 * spots.led + i] = spots.by_led[:, :, i].T
    dense[:, :, -1] = spots.residuals.T
    for axis in range(2):
        # Each spot has the six parameters of its pose as columns.
        pose: scipy.sparse.csc_array = scipy.sparse.csc_array(
            (spots.by_pose[:, axis].ravel(), unknowns, ends), shape=(poses.stop, n)
        )
        weighted = weights @ dense[axis]
        across = np.asarray(pose @ weighted)
        normal[poses, poses] += np.asarray(pose @ np.asarray(pose @ weights).T)
        normal[poses.start : poses.stop, columns] += across
        normal[columns, poses.start : poses.stop] += across.T
        normal[np.ix_(columns, columns)] += dense[axis].T @ weighted


def _anchor_rows(
    look: ResidualSample, body: ProbeBody, k: int, blocks: dict[str, slice], width: int
) -> Float:
    known, covariance = look.known_tip_world, look.known_tip_covariance
    assert known is not None  # noqa: S101 - the caller has looked
    assert covariance is not None  # noqa: S101 - as above
    rows = np.zeros((3, width))
    rows[:, 6 * k + 3 : 6 * k + 6] = np.eye(3)
    rows[:, blocks["probe"].stop - 3 : blocks["probe"].stop] = look.rotation_world_from_probe
    rows[:, blocks["common"]] = -np.hstack([-skew(known), np.eye(3)])
    rows[:, -1] = known - tips_world([look], body)[0]
    root = np.linalg.cholesky(covariance)
    return scipy.linalg.solve_triangular(root, rows, lower=True)


def _change(information: Float, score: Float, units: Float) -> PossibleChange:
    """Return the change implied by information and score, both per unit of each parameter."""
    covariance = np.linalg.inv(information + np.eye(len(units)) / _BOUND**2)
    size = covariance @ score
    return PossibleChange(
        score=float(score @ size),
        dof=len(units),
        size=size * units,
        covariance=covariance * np.outer(units, units),
    )


def camera_changes(camera: CameraModel) -> Float:
    """Return d(`camera.model.PARAMETERS`)/d(`CAMERA_CHANGES`), (14, 9)."""
    columns = np.zeros((N_PARAMETERS, len(CAMERA_CHANGES)))
    # The parameters turn the scene about the world origin; a rotation of the camera about its
    # projection centre is the inverse and also changes the translation.
    columns[0:3, 0:3] = -np.eye(3)
    columns[3:6, 0:3] = skew(camera.T_camera_from_world.translation)
    columns[3:6, 3:6] = -np.eye(3)
    columns[6, 6] = columns[8, 7] = columns[9, 8] = 1.0
    return columns
