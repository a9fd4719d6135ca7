"""Judge whether the tip stays in place while the probe is turned in a cone.

Single point articulation (ASME B89.4.22): a geometry error of the probe, which cancels at constant
attitude, turns with the attitude and shows. The tips t_i = k - R_i d of a resting ball at k
determine the displacement d of the ball from its calibration, in the probe frame. Ball centres of
single observations come with their contributions, and tests with critical values from the
covariance of their inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.camera import Rig, locate_markers, slopes_of_places
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, unit
from ocmm_core.tracking import ProbeBody, tip_sensitivity


def square_limit(covariance: Float, probability: float) -> float:
    """Return the value that a sum of squares exceeds with a probability.

    Chi-square of the same three moments (Pearson; J. P. Imhof, Biometrika 48, 1961, 419-426,
    equation 4.1). ``covariance`` (n, n): of the squared normal numbers of mean zero.
    """
    values = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    first, second, third = (float(np.sum(values**power)) for power in (1, 2, 3))
    if third <= 0.0:
        return 0.0
    freedom = second**3 / third**2
    deviation = (float(scipy.special.chdtri(freedom, probability)) - freedom) / np.sqrt(freedom)
    return float(first + deviation * np.sqrt(second))


def range_limit(covariance: Float, probability: float) -> float:
    """Return the range that normal numbers exceed with at most a probability.

    Sum of the probabilities of all pairs, nearly sharp far out. ``covariance`` (n, n), mean zero.
    """
    variances = np.diag(covariance)
    upper = np.triu_indices(len(variances), 1)
    sigmas = np.sqrt(
        np.maximum((variances[:, None] + variances[None] - 2.0 * covariance)[upper], 0.0)
    )
    largest = float(np.max(sigmas, initial=0.0))
    if largest == 0.0:
        return 0.0
    sigmas = sigmas[sigmas > 1e-6 * largest] / largest

    def excess(limit: float) -> float:
        return float(np.sum(2.0 * scipy.special.ndtr(-limit / sigmas))) - probability

    return largest * float(scipy.optimize.brentq(excess, 0.1, 40.0, xtol=1e-6))


@dataclass(frozen=True, slots=True)
class RestingTouch:
    """Pose of the probe at rest."""

    tip_world: Float
    """(3,), mm: centre of the ball by the calibration of the probe."""
    rotation_world_from_probe: Float
    """(3, 3)."""
    noise: Float
    """(3, 3), mm^2: covariance by the spots of this observation alone."""
    by_cameras: Float
    """(3, 14 C): derivatives by the cameras' parameters, which all observations share."""
    by_geometry: Float
    """(3, 3 L + 3): by the LEDs and the tip of the probe; they turn with the attitude."""


def touch_of(uv: Float, sigma_px: float, rig: Rig, body: ProbeBody) -> RestingTouch:
    """Return the touch of averaged spots (C, L, 2), px; TrackingError without a pose."""
    found = tip_sensitivity(uv, rig, body)
    return RestingTouch(
        tip_world=found.tip_world,
        # The true tip moves against the estimated one as the probe is turned.
        rotation_world_from_probe=-found.by_geometry[:, -3:],
        noise=noise_covariance(uv[None], [found.by_spots], [sigma_px], rig),
        by_cameras=found.by_cameras,
        by_geometry=found.by_geometry,
    )


def noise_covariance(
    uv: Float, by_spots: Sequence[Float], sigmas_px: Sequence[float], rig: Rig
) -> Float:
    """Return the covariance (3 n, 3 n), mm^2, of tips by errors of their spots (n, C, L, 2), px.

    ``by_spots``: see `TipSensitivity`. Near markers of a tracker have place errors in common, in
    one pose and in several.
    """
    flat = [one.reshape(3, -1) for one in by_spots]
    pattern_px = 0.0 if rig.markers is None else rig.noise.pattern_px
    found: Float = scipy.linalg.block_diag(
        *((sigma**2 - pattern_px**2) * b @ b.T for sigma, b in zip(sigmas_px, flat, strict=True))
    )
    if rig.markers is None:
        return found
    noise = rig.markers.document.noise
    pose, led = np.nonzero(np.isfinite(uv).all(axis=(1, 3)))
    places = locate_markers(rig.cameras, uv[pose, :, led][:, :, None])[:, 0]
    slopes = slopes_of_places(rig.cameras, places, rig.markers.document)
    by_field = np.zeros((len(places), len(found), 3))
    for number, one in enumerate(by_spots):
        own, by_view = slopes[pose == number], one.reshape(3, len(rig.cameras), -1, 2)
        part = slice(3 * number, 3 * number + 3)
        by_field[pose == number, part] = np.einsum("iclx,lcxy->liy", by_view, own)
    apart = np.sum((places[:, None] - places) ** 2, axis=2) / noise.place_length**2
    shared = np.tensordot(np.exp(-0.5 * apart), by_field, axes=1)
    found += noise.place_sigma**2 * np.einsum("liy,ljy->ij", by_field, shared)
    return found


def tips_of(touches: Sequence[RestingTouch]) -> Points3:
    """Return the ball centres (n, 3), mm, world."""
    return np.array([one.tip_world for one in touches]).reshape(-1, 3)


def shared_covariance(by_cameras: Float, by_geometry: Float, rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance (3, 3), mm^2, of a tip due to cameras and probe.

    Derivatives as in `RestingTouch`, or their difference between touches: shared effects cancel.
    """
    return (
        by_cameras @ rig.parameter_covariance @ by_cameras.T
        + by_geometry @ body.geometry_covariance @ by_geometry.T
    )


def joint_covariance(
    touches: Sequence[RestingTouch], directions: Float, rig: Rig, body: ProbeBody
) -> Float:
    """Return the covariance, mm^2, (n k, n k), of n tips projected on ``directions`` (n, k, 3)."""
    n, k, _ = directions.shape
    noise = np.array([one.noise for one in touches])
    cameras = np.array([one.by_cameras for one in touches])
    geometry = np.array([one.by_geometry for one in touches])
    covariance = np.zeros((n, k, n, k))
    own = directions @ noise @ directions.transpose(0, 2, 1)
    covariance[np.arange(n), :, np.arange(n), :] = own
    flat: Float = covariance.reshape(n * k, n * k)
    for jacobian, shared in (
        (cameras, rig.parameter_covariance), (geometry, body.geometry_covariance)
    ):  # fmt: skip
        rows = (directions @ jacobian).reshape(n * k, -1)
        flat = flat + rows @ shared @ rows.T
    return 0.5 * (flat + flat.T)


ARTICULATION_CHANCE = 1e-3
"""Probability that the spread exceeds its limit by chance."""

SEAT_SIGMA_MM = 0.002
"""Seating repeatability of a clean ball in a clean cone, standard deviation per axis."""

_WORST_CONDITION = 1e10


@dataclass(frozen=True, slots=True)
class Articulation:
    """The ball in a cone."""

    off_world: Points3
    """(n, 3), mm: tips less their mean."""
    spread_2s: float
    largest: float
    """`spread_2s`, `largest`: mm: two standard deviations, and largest distance from the mean."""
    half_range: Float
    """(3,), mm: half of largest less smallest, per world axis."""
    spread_limit: float
    largest_limit: float
    """`spread_limit`, `largest_limit`: mm: allowed by the stated uncertainties."""


@dataclass(frozen=True, slots=True)
class BallPlace:
    """Position of the ball in the probe against its calibration."""

    offset_probe: Float
    """(3,), mm: true less calibrated."""
    covariance: Float
    """(3, 3), mm^2: with that of the calibration."""
    axis_probe: Float
    """(3,): from the ball to the middle of the LEDs, unit."""

    @property
    def length_error(self) -> float:
        """Return the increase of the ball's distance from the LEDs over calibration, mm."""
        return -float(self.offset_probe @ self.axis_probe)

    @property
    def length_sigma(self) -> float:
        """Return the standard uncertainty of the length error, mm."""
        return float(np.sqrt(self.axis_probe @ self.covariance @ self.axis_probe))

    @property
    def sideways(self) -> float:
        """Return the displacement of the ball across that direction, mm."""
        return float(np.linalg.norm(self._across @ self.offset_probe))

    @property
    def sideways_sigma(self) -> float:
        """Return the larger standard uncertainty across that direction, mm."""
        across = self._across @ self.covariance @ self._across
        return float(np.sqrt(np.linalg.eigvalsh(across)[-1]))

    @property
    def _across(self) -> Float:
        return np.eye(3) - np.outer(self.axis_probe, self.axis_probe)


def articulate(
    touches: Sequence[RestingTouch], rig: Rig, body: ProbeBody, chance: float = ARTICULATION_CHANCE
) -> Articulation:
    """Return the spread of the tips, with its limits; CalibrationError below two attitudes."""
    n = len(touches)
    if n < 2:
        raise CalibrationError(
            "tip.few_attitudes",
            f"{n} attitudes in the cone are too few to judge the tip.",
            "Hold the probe in five attitudes.",
        )
    tips = tips_of(touches)
    off = tips - tips.mean(axis=0)
    square = np.sum(off**2, axis=1)
    centring = np.kron(np.eye(n) - 1.0 / n, np.eye(3))
    covariance = centring @ _covariance(touches, rig, body) @ centring.T
    blocks = covariance.reshape(n, 3, n, 3)
    largest = max(square_limit(blocks[i, :, i], chance / n) for i in range(n))
    return Articulation(
        off_world=off,
        spread_2s=2.0 * float(np.sqrt(square.sum() / (n - 1))),
        largest=float(np.sqrt(square.max())),
        half_range=0.5 * np.ptp(tips, axis=0),
        spread_limit=2.0 * float(np.sqrt(square_limit(covariance, chance) / (n - 1))),
        largest_limit=float(np.sqrt(largest)),
    )


def place_of_ball(touches: Sequence[RestingTouch], rig: Rig, body: ProbeBody) -> BallPlace | None:
    """Return the ball's position in the probe; None if undetermined by the attitudes."""
    n = len(touches)
    turns = np.array([one.rotation_world_from_probe for one in touches]).reshape(-1, 3, 3)
    rows = np.concatenate(
        [np.broadcast_to(np.eye(3), (n, 3, 3)), -turns], axis=2
    ).reshape(3 * n, 6)  # fmt: skip
    if n < 3 or np.linalg.cond(rows) ** 2 > _WORST_CONDITION:
        return None
    covariance = _covariance(touches, rig, body)
    weighted = np.linalg.solve(covariance, rows)
    inverse = np.linalg.inv(rows.T @ weighted)
    found = inverse @ weighted.T @ tips_of(touches).ravel()
    return BallPlace(found[3:], inverse[3:, 3:], handle_axis(body))


def handle_axis(body: ProbeBody) -> Float:
    """Return the direction from the ball to the middle of the LEDs, (3,), probe frame."""
    return unit(body.leds_probe.mean(axis=0) - body.tip_probe)


def _covariance(touches: Sequence[RestingTouch], rig: Rig, body: ProbeBody) -> Float:
    n = len(touches)
    axes = np.broadcast_to(np.eye(3), (n, 3, 3))
    seats: Float = SEAT_SIGMA_MM**2 * np.eye(3 * n)
    return joint_covariance(touches, axes, rig, body) + seats
