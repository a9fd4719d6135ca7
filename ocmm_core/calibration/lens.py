"""A camera with three more lens terms than the running model, to find out whether they are needed.

The running model (`camera.model`) stays as it is: k1, k2, p1, p2. Here k3 (radial, r^6) and the
thin prism s1, s2 (Weng 1992) are added on the image, so that a fit can free them and say what they
change. A camera that needs them is refused rather than used with the wrong model (`guards`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ocmm_core.camera.model import (
    N_PARAMETERS,
    PARAMETERS,
    CameraModel,
    project,
    projection_jacobians,
)
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
    extra: Float = field(default_factory=lambda: np.zeros(3))

    def moved(self, change: Float) -> LensCamera:
        """Return this camera with ``change`` (17,), in the order of `ALL_PARAMETERS`, added."""
        return LensCamera(
            self.model.perturbed(change[:N_PARAMETERS]), self.extra + change[N_PARAMETERS:]
        )


def project_extended(camera: LensCamera, points_world: Points3) -> Pixels:
    """Return the pixel coordinates (n, 2) of world points (n, 3), mm; NaN behind the camera."""
    uv = project(camera.model, points_world)
    if not camera.extra.any():
        return uv
    ideal = _ideal(camera.model, points_world)
    terms, _ = _extra_terms(ideal)
    moved: Pixels = uv + _scale(camera.model) * (terms @ camera.extra)
    return moved


def extended_jacobians(
    camera: LensCamera, points_world: Points3, extra_terms: bool
) -> tuple[Float, Float]:
    """Return how pixels move with the point, (n, 2, 3), px/mm, and with the camera, (n, 2, 14|17).

    The extra terms act on the ideal image point, whose own derivatives are those of the same camera
    without distortion.
    """
    d_point, d_parameters = projection_jacobians(camera.model, points_world)
    if not extra_terms:
        return d_point, d_parameters
    model = camera.model
    pinhole = replace(model, k1=0.0, k2=0.0, p1=0.0, p2=0.0, aspect=1.0)
    ideal_point, ideal_parameters = projection_jacobians(pinhole, points_world)
    terms, slope = _extra_terms(_ideal(model, points_world))
    scale = _scale(model)
    # From ideal pixels of pitch 1/Sy back to mm, and on to the pixels of the camera.
    chain = scale[:, None] * np.einsum("nijk,k->nij", slope, camera.extra) * model.pitch_mm
    d_point = d_point + chain @ ideal_point
    own = d_parameters.copy()
    moves_ideal = slice(0, PARAMETERS.index("aspect"))
    own[:, :, moves_ideal] += chain @ ideal_parameters[:, :, moves_ideal]
    own[:, 0, PARAMETERS.index("aspect")] += (terms[:, 0] @ camera.extra) / model.pitch_mm
    return d_point, np.concatenate([own, scale[:, None] * terms], axis=2)


def _scale(model: CameraModel) -> Float:
    return np.array([model.sx, model.sy])


def _ideal(model: CameraModel, points_world: Points3) -> Float:
    in_camera = model.T_camera_from_world.apply(points_world)
    ideal: Float = model.focal * in_camera[:, :2] / in_camera[:, 2:]
    return ideal


def _extra_terms(ideal: Float) -> tuple[Float, Float]:
    """Return what a unit of each term adds, (n, 2, 3), and its slope by the ideal point.

    The slope is (n, 2, 2, 3).
    """
    x, y = ideal.T
    r2 = x * x + y * y
    terms = np.zeros((len(x), 2, 3))
    terms[:, 0, 0], terms[:, 1, 0] = x * r2**3, y * r2**3
    terms[:, 0, 1] = terms[:, 1, 2] = r2
    slope = np.zeros((len(x), 2, 2, 3))
    slope[:, 0, 0, 0] = r2**3 + 6.0 * x * x * r2**2
    slope[:, 0, 1, 0] = slope[:, 1, 0, 0] = 6.0 * x * y * r2**2
    slope[:, 1, 1, 0] = r2**3 + 6.0 * y * y * r2**2
    slope[:, 0, 0, 1] = slope[:, 1, 0, 2] = 2.0 * x
    slope[:, 0, 1, 1] = slope[:, 1, 1, 2] = 2.0 * y
    return terms, slope
