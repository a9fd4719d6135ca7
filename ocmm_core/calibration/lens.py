"""A camera with three more lens terms than the running model, to find out whether they are needed.

The running model (`camera.model`) stays as it is: k1, k2, p1, p2. Here k3 (radial, r^6) and the
thin prism s1, s2 (Weng 1992) are added, so that a fit can free them and say what they change. A
camera that needs them is refused rather than used with the wrong model (`guards`).

Derivatives lie column after column in memory: a fit of 400 points takes half as long that way.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.camera.model import N_PARAMETERS, PARAMETERS, CameraModel
from ocmm_core.geometry import Float, Pixels, Points3

EXTRA_TERMS = ("k3", "s1", "s2")
"""Radial, mm^-6; thin prism along x and y, mm^-1."""

ALL_PARAMETERS = (*PARAMETERS, *EXTRA_TERMS)
"""Order of everything that can be fitted."""


@dataclass(frozen=True, slots=True)
class LensCamera:
    """A camera model with the extra terms.

    Attributes
    ----------
    model
        The running model.
    extra
        (3,), in the order of `EXTRA_TERMS`.
    """

    model: CameraModel
    extra: Float = field(default_factory=lambda: np.zeros(len(EXTRA_TERMS)))

    def moved(self, change: Float) -> LensCamera:
        """Return this camera with ``change`` (17,), in the order of `ALL_PARAMETERS`, added."""
        return LensCamera(
            self.model.perturbed(change[:N_PARAMETERS]), self.extra + change[N_PARAMETERS:]
        )


@dataclass(frozen=True, slots=True)
class Seen:
    """Where a camera sees points and how that moves.

    Attributes
    ----------
    uv
        (2, n), px; infinite behind the camera.
    d_parameters
        (terms, 2, n), in the order of `ALL_PARAMETERS`.
    """

    uv: Float
    d_parameters: Float

    def d_point(self, camera: LensCamera) -> Float:
        """Return d(pixel)/d(point), (2, 3, n), px/mm, world frame, for the camera that saw this.

        A shift of the point and one of the camera differ by the rotation alone.
        """
        rotation = camera.model.T_camera_from_world.rotation
        by_point: Float = np.einsum("aun,ab->ubn", self.d_parameters[3:6], rotation)
        return by_point


def see(camera: LensCamera, points_world: Points3, terms: int = len(ALL_PARAMETERS)) -> Seen:
    """Return the pixels of world points (n, 3), mm, and their derivatives.

    Of the extra terms only those are derived that are among the first ``terms`` (14 to 17)
    parameters.
    """
    model = camera.model
    k1, k2, p1, p2 = model.k1, model.k2, model.p1, model.p2
    k3, s1, s2 = camera.extra
    f, scale = model.focal, np.array([[model.sx], [model.sy]])
    pose = model.T_camera_from_world
    rotated = pose.rotation @ points_world.T
    in_camera = rotated + pose.translation[:, None]
    if not (in_camera[2] > 0.0).all():
        in_camera[2, in_camera[2] <= 0.0] = np.nan
    inverse_depth = 1.0 / in_camera[2]
    tangents = in_camera[:2] * inverse_depth
    ideal = f * tangents
    x, y = ideal
    squares = ideal * ideal
    r2 = squares[0] + squares[1]
    xy2 = 2.0 * x * y
    along = r2 + 2.0 * squares
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * k1 + r2 * (4.0 * k2 + 6.0 * k3 * r2)
    distorted = radial * ideal
    distorted[0] += p1 * xy2 + p2 * along[0]
    distorted[1] += p1 * along[1] + p2 * xy2

    # d_ideal[i, j]: derivative of pixel coordinate j by ideal coordinate i.
    d_ideal = np.empty((2, 2, len(x)))
    cross = 0.5 * xy2 * slope + 2.0 * (p1 * x + p2 * y)
    d_ideal[0, 1] = d_ideal[1, 0] = cross
    d_ideal[0, 0] = radial + squares[0] * slope + 2.0 * p1 * y + 6.0 * p2 * x
    d_ideal[1, 1] = radial + squares[1] * slope + 6.0 * p1 * y + 2.0 * p2 * x
    if s1 != 0.0 or s2 != 0.0:
        prism = np.array([s1, s2])
        distorted += prism[:, None] * r2
        d_ideal += 2.0 * ideal[:, None] * prism[:, None]
    d_ideal *= scale

    by = np.zeros((terms, 2, len(x)))
    d_focal = by[6]
    np.multiply(d_ideal[0], tangents[0], out=d_focal)
    d_focal += d_ideal[1] * tangents[1]
    d_camera = by[3:6]
    to_depth = f * inverse_depth
    np.multiply(d_ideal, to_depth, out=d_camera[:2])
    np.multiply(d_focal, -to_depth, out=d_camera[2])
    by[0] = rotated[1] * d_camera[2] - rotated[2] * d_camera[1]
    by[1] = rotated[2] * d_camera[0] - rotated[0] * d_camera[2]
    by[2] = rotated[0] * d_camera[1] - rotated[1] * d_camera[0]
    by[7, 0] = distorted[0] / model.pitch_mm
    by[8, 0] = by[9, 1] = 1.0
    np.multiply(scale * ideal, r2, out=by[10])
    np.multiply(by[10], r2, out=by[11])
    by[12, 0], by[12, 1] = model.sx * xy2, model.sy * along[1]
    by[13, 0], by[13, 1] = model.sx * along[0], model.sy * xy2
    if terms > N_PARAMETERS:
        extra = np.zeros((len(EXTRA_TERMS), 2, len(x)))
        np.multiply(by[11], r2, out=extra[0])
        extra[1, 0], extra[2, 1] = model.sx * r2, model.sy * r2
        by[N_PARAMETERS:] = extra[: terms - N_PARAMETERS]
    uv = scale * distorted + np.array([[model.u0], [model.v0]])
    return Seen(np.where(np.isnan(uv), np.inf, uv), by)


def project_extended(camera: LensCamera, points_world: Points3) -> Pixels:
    """Return the pixel coordinates (n, 2) of world points (n, 3), mm; infinite behind it."""
    return see(camera, points_world, N_PARAMETERS).uv.T
