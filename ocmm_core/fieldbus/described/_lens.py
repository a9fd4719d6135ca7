"""Conversion of a camera's corrected millimetres back to raw pixels.

Measurements use raw pixels and our own calibration. A correcting camera has computed x = g(xd) from
the distorted point xd with its lens parameters. With the same parameters the correction is inverted
exactly, even if it was approximate.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import CameraModel, distort, distortion_jacobian, from_pixels, to_pixels
from ocmm_core.camera import ideal_from_pixels as _exactly
from ocmm_core.fieldbus.described._device_file import Sends
from ocmm_core.geometry import Float

_STEPS = 3
"""Newton doubles the digits: from 2 % of distortion to 1e-12 of it in three steps."""


def corrected_from_pixels(camera: CameraModel, uv: Float, sends: Sends) -> Float:
    """Return corrected image points, mm, as sent for pixels (..., 2).

    The one-step form is that of the thesis, 2.4.1: the distortion of the *distorted* point is
    subtracted, ``x = xd - d(xd)``.
    """
    if sends is Sends.EXACT:
        return _exactly(camera, uv)
    distorted = from_pixels(camera, uv)
    corrected: Float = 2.0 * distorted - distort(camera, distorted)
    return corrected


def pixels_from_corrected(camera: CameraModel, corrected: Float, sends: Sends) -> Float:
    """Return the pixels (..., 2) of corrected image points (..., 2), mm.

    The one-step form ``2 xd - (xd + d(xd)) = x`` is solved by Newton's method; its derivative is
    ``2 I - J`` with `distortion_jacobian` J.
    """
    if sends is Sends.EXACT:
        return to_pixels(camera, distort(camera, corrected))
    distorted = np.array(corrected, dtype=np.float64)
    for _ in range(_STEPS):
        miss = corrected - (2.0 * distorted - distort(camera, distorted))
        slope = 2.0 * np.eye(2) - distortion_jacobian(camera, distorted)
        determinant = slope[..., 0, 0] * slope[..., 1, 1] - slope[..., 0, 1] * slope[..., 1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            step_x = (slope[..., 1, 1] * miss[..., 0] - slope[..., 0, 1] * miss[..., 1]) / (
                determinant
            )
            step_y = (slope[..., 0, 0] * miss[..., 1] - slope[..., 1, 0] * miss[..., 0]) / (
                determinant
            )
        distorted = distorted + np.stack([step_x, step_y], axis=-1)
    return to_pixels(camera, distorted)
