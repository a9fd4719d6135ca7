"""Points of cameras without proof of a common exposure time: the share of the skew in U."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.measuring._point import Refusal, RefusalCode
from ocmm_core.measuring._stable_point import StablePoint
from ocmm_core.tracking import CameraSkew, FrameStatus, ProbeBody, TrackBlock, tip_sensitivity

SWING_MM_S = 20.0
"""Largest speed of an LED while a point is measured: 5 mm in a window, with the ball at rest."""

UNKNOWN_SKEW = (
    "How far apart in time the cameras expose is not known yet.",
    "Hold the probe still before the cameras, then wave it in all directions for some seconds, and "
    "touch again.",
)
"""Reason of a refusal, and its remedy, until the skew has been measured."""


def with_skew(
    point: StablePoint, window: TrackBlock, rig: Rig, body: ProbeBody, skew: CameraSkew
) -> StablePoint | Refusal:
    """Return a point with the uncertainty of the skew, or why it is refused.

    The frames of ``window`` were aligned by the skew. Its uncertainty moves the spots of a camera
    by their mean speed in the window: the ball may rest while the LEDs swing about it.
    """
    if not skew.known:
        return Refusal(RefusalCode.NOT_READY, *UNKNOWN_SKEW, point.time_s)
    inside = (window.counter >= point.first_frame) & (window.counter <= point.last_frame)
    used = np.flatnonzero(inside & (window.status == FrameStatus.OK))
    times = np.asarray(window.time_ns[used] * 1e-9, dtype=np.float64)
    turned = window.rotation_world_from_probe[used] @ body.leds_probe.T
    places = turned.transpose(0, 2, 1) + window.origin_world[used, None]
    swing = float(np.linalg.norm(_slope(times, places), axis=1).max())
    if swing > SWING_MM_S:
        return Refusal(
            RefusalCode.MOVING,
            f"The probe moved at {swing:.1f} mm/s while it was measured, and the cameras do not "
            "expose at the same time.",
            "Hold the probe still, not only its ball, until the tone.",
            point.time_s,
        )
    sensitivity = tip_sensitivity(point.spots, rig, body)
    speed = _slope(times, window.uv[used])[np.isfinite(point.spots).all(axis=2)]
    by_skew = np.zeros((3, len(rig.cameras)))
    np.add.at(by_skew.T, sensitivity.camera, np.einsum("ima,ma->mi", sensitivity.by_spots, speed))
    own = by_skew @ skew.covariance @ by_skew.T
    return replace(point, random_covariance=point.random_covariance + own)


def _slope(times: Float, values: Float) -> Float:
    """Return the slope of values (n, ...) over times (n,) by least squares."""
    about = times - times.mean()
    return np.tensordot(about, values, axes=1) / float(about @ about)
