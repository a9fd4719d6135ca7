"""From a window of tracked frames to one averaged ball centre, or a refusal.

The reason for frames without tip names the camera and the LED that it misses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core import tracking
from ocmm_core.camera import Rig, independent_share
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._point import Refusal, RefusalCode


def explain(window: tracking.TrackBlock, rig: Rig, time_s: float) -> Refusal:
    """Return the refusal for a window with too few frames with a tip."""
    bad = window.status[window.status != tracking.FrameStatus.OK]
    worst = tracking.FrameStatus(int(np.bincount(bad).argmax()))
    if worst is tracking.FrameStatus.REFERENCE_LOST and window.reference is not None:
        return explain_reference(window.reference, rig, time_s)
    if worst is tracking.FrameStatus.DOUBTFUL:
        return Refusal(
            RefusalCode.DOUBTFUL,
            "The spots do not fit the probe: a reflection, a wrong probe or a moved camera.",
            "Cover reflections and check the probe. If it persists, verify the cameras.",
            time_s,
        )
    if worst is tracking.FrameStatus.UNIDENTIFIED:
        return Refusal(
            RefusalCode.UNIDENTIFIED,
            "The LEDs are seen but cannot be identified uniquely.",
            "Turn the probe so that all its LEDs face the cameras.",
            time_s,
        )
    return Refusal(
        RefusalCode.LOST,
        _who_sees_nothing(window, worst, rig, "the probe", "LED ", ""),
        "Turn the LEDs towards the cameras and clear the line of sight, then touch again.",
        time_s,
    )


def explain_reference(seen: tracking.ReferenceTrack, rig: Rig, time_s: float) -> Refusal:
    """Return the refusal for a window in which the reference body failed."""
    body = seen.body
    bad = body.status[body.status != tracking.FrameStatus.OK]
    if not len(bad):
        return Refusal(
            RefusalCode.REFERENCE,
            "The position of the reference body is not known yet.",
            "Let part and cameras come to rest until the machine is ready.",
            time_s,
        )
    worst = tracking.FrameStatus(int(np.bincount(bad).argmax()))
    if worst is tracking.FrameStatus.DOUBTFUL:
        return Refusal(
            RefusalCode.REFERENCE,
            "The spots do not fit the reference body: a reflection, another body or a moved "
            "camera.",
            "Cover reflections and check the reference body. If it persists, verify the cameras.",
            time_s,
        )
    if worst is tracking.FrameStatus.UNIDENTIFIED:
        return Refusal(
            RefusalCode.REFERENCE,
            "The reference body is not recognised among the visible lights.",
            "Clear the line of sight to all its LEDs and cover reflections.",
            time_s,
        )
    why = _who_sees_nothing(body, worst, rig, "the reference body", "", "R")
    return Refusal(
        RefusalCode.REFERENCE,
        f"Reference body not visible. {why}",
        "Keep hand and probe out of the line of sight to its LEDs, then touch again.",
        time_s,
    )


def _who_sees_nothing(
    window: tracking.TrackBlock,
    status: tracking.FrameStatus,
    rig: Rig,
    what: str,
    before: str,
    each: str,
) -> str:
    """Return the sentence that names the cameras and their hidden LEDs.

    Only frames of ``status`` count: in the others, before the view was hidden, all may be seen.
    ``before`` precedes all LED numbers, ``each`` each of them.
    """
    hidden = np.mean(np.isfinite(window.uv[window.status == status, ..., 0]), axis=0) < 0.5
    if rig.markers is not None and hidden.any():
        # Its cameras see alike.
        numbers = ", ".join(f"{each}{led + 1}" for led in np.flatnonzero(hidden.any(axis=0)))
        absent = what if hidden.all() else f"{before}{numbers}"
        return f"The tracker does not report {absent}."
    if hidden.all():
        return f"The cameras do not see {what}."
    parts = []
    for camera, leds in zip(rig.cameras, hidden, strict=True):
        if leds.any():
            numbers = ", ".join(f"{each}{led + 1}" for led in np.flatnonzero(leds))
            absent = what if leds.all() else f"{before}{numbers}"
            parts.append(f"Camera {camera.name} does not see {absent}.")
    # Whole sentences: fragments joined at run time cannot be translated.
    return " ".join(parts) or "Too few targets are seen by two cameras."


_BATCHES = 10
_OUTLIER_SIGMAS = 5.0
_LEAST_INDEPENDENT = 4.0
_CLEARLY = 2.0
"""Standard deviations above the stated correlation."""


@dataclass(frozen=True, slots=True)
class PointOptions:
    """Conditions for a touch to give a point."""

    window_s: float = 0.25
    """Averaging time from the trigger on."""
    still_mm: float = 0.01
    """Refuse a ball that moves this far during the window, if the motion is distinguishable from
    noise; otherwise the motion enters the uncertainty of the point."""
    min_share: float = 0.8
    """Share of the window's frames that must be present and good."""
    approach_mm: float = 2.0
    """Distance from the contact at which the approach direction is taken."""
    max_uncertainty: float = 0.15
    """Largest expanded uncertainty (k = 2) of a point, mm."""
    untimed_mm: float = 0.0
    """Largest error of a resting ball along each axis from uncertain exposure times
    (`fieldbus.described.resting_doubt_mm`); uniform, so a third of its square is added to each
    variance."""


@dataclass(frozen=True, slots=True)
class StablePoint:
    """The average over a window."""

    time_s: float
    first_frame: int
    last_frame: int
    n_frames: int
    tip_world: Float
    """(3,), mm."""
    random_covariance: Float
    """(3, 3), mm^2, of the average; ``motion_covariance`` and ``untimed_mm`` are parts of it."""
    motion_covariance: Float
    """(3, 3), mm^2: of ball motion below the limit or indistinguishable from noise."""
    rotation_world_from_probe: Float
    """(3, 3), mean attitude."""
    spots: Float
    """(C, L, 2), px, mean, NaN if not seen throughout."""
    chi2_per_dof: float
    tip_rig: Float
    """(3,), mm: ball in the present camera frame; ``tip_world`` without a reference body."""
    reference_spots: Float | None
    """(C, R, 2), px, mean spots of the reference body in the same frames; None without one."""


class TouchNoise:
    """Noise of spots and hand, learnt from the touches of a session; for one probe.

    A new object starts with conservative defaults. Touches that were refused teach the noise of
    the spots, because no motion of the probe changes it, but not that of the hand.
    """

    def __init__(self, rig: Rig, body: tracking.ProbeBody) -> None:
        self._rig, self._leds = rig, body.leds_probe
        self._spectrum, self._hand = tracking.SpotSpectrum(), tracking.HandDrift()

    def judge(
        self, window: tracking.TrackBlock, frames: Int, limit_mm: float
    ) -> tracking.Stillness:
        """Judge whether the ball rested in some frames that see the same LEDs, and learn."""
        seconds, seen = _seconds(window)[frames], tracking.in_rig(window)
        course = tracking.spot_course(
            tracking.batch_labels(seconds), seconds, seen.uv[frames],
            seen.rotation_world_from_probe[frames], seen.origin_world[frames],
            self._rig, self._leds,
        )  # fmt: skip
        self._spectrum = self._spectrum.learnt(course)
        still = tracking.judge_stillness(
            seconds, window.tip_world[frames], window.tip_covariance[frames], limit_mm,
            self._spectrum.between(course), self._hand,
        )  # fmt: skip
        if still.motion is None:
            self._hand = self._hand.learnt(still)
        return still


def average(
    window: tracking.TrackBlock,
    expected: int,
    rig: Rig,
    options: PointOptions,
    noise: TouchNoise | None = None,
) -> StablePoint | Refusal:
    """Average a window of frames if the probe was visible and still.

    The random covariance comes from ten batch means, to include slow tremor, and is at least the
    prediction from independent spot noise. Ball motion indistinguishable from noise is added.
    ``expected`` is the intended number of frames. Without ``noise``, frames are independent and
    the hand is unknown.
    """
    # Poses of the averaged frames themselves: no lag, whatever moved.
    window = tracking.simultaneous(window)
    time_s = float(window.time_ns[len(window) // 2]) * 1e-9 if len(window) else 0.0
    good = window.status == tracking.FrameStatus.OK
    if len(window) < options.min_share * expected:
        return Refusal(
            RefusalCode.GAP,
            f"{expected - len(window)} of {expected} frames did not arrive.",
            "Check the field bus, then touch again.",
            time_s,
        )
    if np.count_nonzero(good) < options.min_share * expected:
        return explain(window, rig, time_s)
    used = good & _alike(window.seen, good)
    if window.reference is not None:
        used &= _alike(window.reference.body.seen, good)
    if np.count_nonzero(used) < 0.5 * options.min_share * expected:
        return _disagreeing(int(np.count_nonzero(used)), expected, time_s)
    # Motion is no outlier: compare a frame with its neighbours, judge movement afterwards.
    apart = tracking.wildness(
        _seconds(window)[used], window.tip_world[used], window.tip_covariance[used]
    )
    keep = np.flatnonzero(used)[apart < _OUTLIER_SIGMAS]
    enough = len(keep) >= 0.5 * options.min_share * expected
    judged = keep if enough else np.flatnonzero(used)
    if noise is not None:
        still = noise.judge(window, judged, options.still_mm)
    else:
        still = tracking.judge_stillness(
            _seconds(window)[judged],
            window.tip_world[judged],
            window.tip_covariance[judged],
            options.still_mm,
        )
    if still.motion is not None:
        return Refusal(
            RefusalCode.MOVING,
            f"The ball {still.motion.kind.value} by {still.motion.size_mm:.3f} mm while it was "
            "measured.",
            "Hold the ball still on the surface until the tone.",
            time_s,
        )
    if not enough:
        return _disagreeing(len(keep), expected, time_s)
    moved = _motion_of_reference(window, keep, options.still_mm)
    if moved is not None:
        return Refusal(
            RefusalCode.REFERENCE,
            f"The reference body moved, {moved.size_mm:.3f} mm at the ball, while the point was "
            f"measured.",
            "Let part and cameras come to rest, then touch again.",
            time_s,
        )
    share = _independent_share(window.tip_world[keep], window.tip_covariance[keep], rig)
    if share * len(keep) < _LEAST_INDEPENDENT:
        return Refusal(
            RefusalCode.DOUBTFUL,
            f"The tracker smooths its markers: {len(keep)} frames tell no more than "
            f"{share * len(keep):.1f} independent ones.",
            "Switch off smoothing and filters in the tracker, then touch again.",
            time_s,
        )
    random = _covariance_of_mean(window.tip_world[keep], window.tip_covariance[keep] / share)
    return StablePoint(
        time_s=time_s,
        first_frame=int(window.counter[keep[0]]),
        last_frame=int(window.counter[keep[-1]]),
        n_frames=len(keep),
        tip_world=window.tip_world[keep].mean(axis=0),
        random_covariance=random + still.covariance + np.eye(3) * options.untimed_mm**2 / 3.0,
        motion_covariance=still.covariance,
        rotation_world_from_probe=mean_rotation(window.rotation_world_from_probe[keep]),
        spots=window.uv[keep].mean(axis=0),
        chi2_per_dof=float(np.mean(window.chi2[keep] / window.dof[keep])),
        tip_rig=tracking.in_rig(window).tip_world[keep].mean(axis=0),
        reference_spots=(
            window.reference.body.uv[keep].mean(axis=0) if window.reference is not None else None
        ),
    )


def _disagreeing(count: int, expected: int, time_s: float) -> Refusal:
    return Refusal(
        RefusalCode.DOUBTFUL,
        f"Only {count} of {expected} frames agree.",
        "Keep hands and cables out of the cameras' view, then touch again.",
        time_s,
    )


def _alike(seen: NDArray[np.uint64], good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the frames (n,) in which the same LEDs are seen as in most good ones."""
    patterns, counts = np.unique(seen[good], axis=0, return_counts=True)
    return np.asarray((seen == patterns[np.argmax(counts)]).all(axis=1))


def _seconds(window: tracking.TrackBlock) -> Float:
    return np.asarray((window.time_ns - window.time_ns[0]) * 1e-9, dtype=np.float64)


def _motion_of_reference(
    window: tracking.TrackBlock, frames: Int, limit_mm: float
) -> tracking.BallMotion | None:
    """Return the motion of the ball by the reference body alone."""
    seen = window.reference
    if seen is None or seen.home is None:
        return None
    turn, shift = tracking.motion_to_world(
        seen.home, seen.body.rotation_world_from_probe[frames], seen.body.origin_world[frames]
    )
    tip_rig = np.median(seen.probe.tip_world[frames], axis=0)
    noise = window.tip_covariance[frames] - (
        turn @ seen.probe.tip_covariance[frames] @ turn.transpose(0, 2, 1)
    )
    carried = turn @ tip_rig + shift
    return tracking.judge_stillness(_seconds(window)[frames], carried, noise, limit_mm).motion


def _independent_share(tips: Float, covariances: Float, rig: Rig) -> float:
    """Return the share of independent frames among those of a tracker, by its filters; else 1.

    For noise of correlation r between consecutive frames (1 - r) / (1 + r); r is that of the
    document, or of these frames if clearly larger.
    """
    if rig.markers is None:
        return 1.0
    factor = np.linalg.cholesky(covariances.mean(axis=0))
    plain = np.linalg.solve(factor, (tips - tips.mean(axis=0)).T)
    found = float(np.sum(plain[:, 1:] * plain[:, :-1]) / np.sum(plain**2))
    # Bias of few frames (Marriott and Pope, Biometrika 41 (1954) 390).
    found = min(found + (1.0 + 4.0 * found) / len(tips), 0.99)
    stated = rig.markers.document.noise.correlation
    doubt = np.sqrt((1.0 - stated**2) / plain.size)
    return independent_share(found if found > stated + _CLEARLY * doubt else stated)


def _covariance_of_mean(tips: Float, covariances: Float) -> Float:
    predicted = covariances.mean(axis=0) / len(tips)
    means = np.array([part.mean(axis=0) for part in np.array_split(tips, _BATCHES)])
    scatter = np.cov(means.T) / _BATCHES
    # Compare in units of the prediction, direction by direction: tremor along the surface, where
    # the cameras are accurate, must not vanish in the noise of the depth.
    factor = np.linalg.cholesky(predicted)
    whitened = np.linalg.solve(factor, np.linalg.solve(factor, scatter).T)
    values, vectors = np.linalg.eigh(0.5 * (whitened + whitened.T))
    spread = factor @ vectors
    covariance: Float = (spread * np.maximum(values, 1.0)) @ spread.T
    return covariance


def mean_rotation(rotations: Float) -> Float:
    """Return the mean of rotations (n, 3, 3)."""
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    rotation: Float = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation
