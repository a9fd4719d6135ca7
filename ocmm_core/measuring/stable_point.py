"""From a window of tracked frames to one averaged ball centre, or the reason why there is none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.measuring.point import Refusal, RefusalCode
from ocmm_core.tracking.result import FrameStatus, TrackBlock

_BATCHES = 10
_OUTLIER_SIGMAS = 5.0


@dataclass(frozen=True, slots=True)
class PointOptions:
    """What a touch must be like to give a point.

    Attributes
    ----------
    window_s
        Frames of this much time are averaged, from the trigger on.
    still_mm
        The ball may wander no more than this during the window, beyond what noise explains.
    min_share
        Share of the window's frames that must be there and good.
    approach_mm
        The approach direction is taken where the ball was this far from the contact.
    max_uncertainty
        Largest expanded uncertainty (k = 2) of a point, mm.
    """

    window_s: float = 0.25
    still_mm: float = 0.05
    min_share: float = 0.8
    approach_mm: float = 2.0
    max_uncertainty: float = 0.15


@dataclass(frozen=True, slots=True)
class StablePoint:
    """The average over a window.

    Attributes
    ----------
    time_s, first_frame, last_frame, n_frames
        The window and how many of its frames were used.
    tip_world
        (3,), mm.
    random_covariance
        (3, 3), mm^2, of the average.
    rotation_world_from_probe
        (3, 3), mean attitude.
    spots
        (C, L, 2), px, mean, NaN where not seen throughout.
    chi2_per_dof
        Mean.
    """

    time_s: float
    first_frame: int
    last_frame: int
    n_frames: int
    tip_world: Float
    random_covariance: Float
    rotation_world_from_probe: Float
    spots: Float
    chi2_per_dof: float


def average(
    window: TrackBlock, expected: int, rig: Rig, options: PointOptions
) -> StablePoint | Refusal:
    """Average a window of frames, if the probe was seen and held still.

    Parameters
    ----------
    window
        The frames of the window that arrived.
    expected
        How many there should be.
    rig
        For the names of the cameras.

    Returns
    -------
    StablePoint or Refusal
        The random covariance comes from ten batch means, so that slow tremor counts as what it
        is, and is never less than what independent spot noise predicts.
    """
    time_s = float(window.time_ns[len(window) // 2]) * 1e-9 if len(window) else 0.0
    good = window.status == FrameStatus.OK
    if len(window) < options.min_share * expected:
        return Refusal(
            RefusalCode.GAP,
            f"{expected - len(window)} of {expected} frames did not arrive.",
            "Check the field bus, then touch again.",
            time_s,
        )
    if np.count_nonzero(good) < options.min_share * expected:
        return explain(window, rig, time_s)
    used = good & (_most_common(window.seen[good]) == window.seen).all(axis=1)
    if np.count_nonzero(used) < 0.5 * options.min_share * expected:
        return _disagreeing(int(np.count_nonzero(used)), expected, time_s)
    tips = window.tip_world[used]
    centre = np.median(tips, axis=0)
    inverse = np.linalg.inv(window.tip_covariance[used])
    apart = np.sqrt(np.einsum("ni,nij,nj->n", tips - centre, inverse, tips - centre))
    # The centre of a moving window lies away from most frames: judge movement before outliers.
    wander = _wander(tips)
    if wander > max(options.still_mm, _wander_of_noise(window.tip_covariance[used])):
        return Refusal(
            RefusalCode.MOVING,
            f"The ball moved {wander:.3f} mm while it was measured.",
            "Hold the ball still on the surface until the sound.",
            time_s,
        )
    keep = np.flatnonzero(used)[apart < _OUTLIER_SIGMAS]
    if len(keep) < 0.5 * options.min_share * expected:
        return _disagreeing(len(keep), expected, time_s)
    return StablePoint(
        time_s=time_s,
        first_frame=int(window.counter[keep[0]]),
        last_frame=int(window.counter[keep[-1]]),
        n_frames=len(keep),
        tip_world=window.tip_world[keep].mean(axis=0),
        random_covariance=_covariance_of_mean(window.tip_world[keep], window.tip_covariance[keep]),
        rotation_world_from_probe=_mean_rotation(window.rotation_world_from_probe[keep]),
        spots=window.uv[keep].mean(axis=0),
        chi2_per_dof=float(np.mean(window.chi2[keep] / window.dof[keep])),
    )


def _disagreeing(count: int, expected: int, time_s: float) -> Refusal:
    return Refusal(
        RefusalCode.DOUBTFUL,
        f"Only {count} of {expected} frames agree with each other.",
        "Keep hands and cables out of the view of the cameras, then touch again.",
        time_s,
    )


def _most_common(seen: NDArray[np.uint16]) -> NDArray[np.uint16]:
    patterns, counts = np.unique(seen, axis=0, return_counts=True)
    common: NDArray[np.uint16] = patterns[np.argmax(counts)]
    return common


def _batch_means(tips: Float) -> Float:
    return np.array([part.mean(axis=0) for part in np.array_split(tips, _BATCHES)])


def _wander(tips: Float) -> float:
    """Return the greatest distance between the batch means and their centre, twice, mm."""
    means = _batch_means(tips)
    return 2.0 * float(np.linalg.norm(means - means.mean(axis=0), axis=1).max())


def _wander_of_noise(covariances: Float) -> float:
    """Return the wander, mm, that spot noise alone hardly ever exceeds."""
    variance = float(np.linalg.eigvalsh(covariances.mean(axis=0))[-1])
    return 2.0 * _OUTLIER_SIGMAS * float(np.sqrt(variance * _BATCHES / len(covariances)))


def _covariance_of_mean(tips: Float, covariances: Float) -> Float:
    predicted = covariances.mean(axis=0) / len(tips)
    means = _batch_means(tips)
    scatter = np.cov(means.T) / _BATCHES
    # Compare in units of the prediction, direction by direction: a hand trembles along the surface
    # where the cameras see well, and that must not drown in the noise of the depth.
    factor = np.linalg.cholesky(predicted)
    whitened = np.linalg.solve(factor, np.linalg.solve(factor, scatter).T)
    values, vectors = np.linalg.eigh(0.5 * (whitened + whitened.T))
    spread = factor @ vectors
    covariance: Float = (spread * np.maximum(values, 1.0)) @ spread.T
    return covariance


def _mean_rotation(rotations: Float) -> Float:
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    rotation: Float = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation


def explain(window: TrackBlock, rig: Rig, time_s: float) -> Refusal:
    """Return the refusal for a window in which too few frames have a tip."""
    bad = window.status[window.status != FrameStatus.OK]
    worst = FrameStatus(int(np.bincount(bad).argmax()))
    if worst is FrameStatus.DOUBTFUL:
        return Refusal(
            RefusalCode.DOUBTFUL,
            "The spots do not fit the probe: a reflection, a wrong probe or a moved camera.",
            "Cover reflections and check the probe; if it stays, verify the cameras.",
            time_s,
        )
    if worst is FrameStatus.UNIDENTIFIED:
        return Refusal(
            RefusalCode.UNIDENTIFIED,
            "The LEDs are seen, but it is not certain which is which.",
            "Turn the probe so that all its LEDs face the cameras.",
            time_s,
        )
    return Refusal(
        RefusalCode.LOST,
        _who_sees_nothing(window, rig),
        "Turn the LEDs towards the cameras and clear the view, then touch again.",
        time_s,
    )


def _who_sees_nothing(window: TrackBlock, rig: Rig) -> str:
    """Return the sentence that names the cameras and the LEDs that they do not see."""
    hidden = np.mean(np.isfinite(window.uv[..., 0]), axis=0) < 0.5
    if hidden.all():
        return "The cameras do not see the probe."
    parts = []
    for camera, leds in zip(rig.cameras, hidden, strict=True):
        if leds.all():
            parts.append(f"camera {camera.name} does not see the probe")
        elif leds.any():
            numbers = ", ".join(str(led + 1) for led in np.flatnonzero(leds))
            parts.append(f"camera {camera.name} does not see LED {numbers}")
    sentence = " and ".join(parts) or "too few targets are seen by two cameras"
    return f"{sentence[0].upper()}{sentence[1:]}."
