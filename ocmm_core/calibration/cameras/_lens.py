"""Camera with three extra lens terms, to test whether they are needed.

k3 (radial, r^6) and the thin prism s1, s2 (Weng 1992) extend the running model (`camera.model`: k1,
k2, p1, p2). A camera that needs them is refused (`guards`).
Residuals and derivatives are compiled; numpy takes three times as long.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel
from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float, Pixels, Points3

EXTRA_TERMS = ("k3", "s1", "s2")
"""Radial, mm^-6; thin prism along x and y, mm^-1."""

ALL_PARAMETERS = (*PARAMETERS, *EXTRA_TERMS)
_N_TERMS = len(ALL_PARAMETERS)


@dataclass(frozen=True, slots=True)
class LensCamera:
    """A camera model with the extra terms."""

    model: CameraModel
    extra: Float = field(default_factory=lambda: np.zeros(len(EXTRA_TERMS)))
    """(3,), in the order of `EXTRA_TERMS`."""

    def moved(self, change: Float) -> LensCamera:
        """Return this camera with ``change`` (17,), in the order of `ALL_PARAMETERS`, added."""
        return LensCamera(
            self.model.perturbed(change[:N_PARAMETERS]), self.extra + change[N_PARAMETERS:]
        )

    def packed(self) -> Float:
        """Return the parameters in kernel form, (24,)."""
        return np.concatenate([self.model.packed(), self.extra])


@dataclass(frozen=True, slots=True)
class ProjectedPoints:
    """Residuals of projected points with derivatives."""

    residuals: Float
    """(2, n): u and v of predicted minus observed, whitened; infinite behind the camera."""
    rows: Float
    """(terms, 2, n): derivatives in the order of `ALL_PARAMETERS`."""


def project_with_jacobian(
    camera: LensCamera,
    points_world: Points3,
    terms: int = len(ALL_PARAMETERS),
    uv: Pixels | None = None,
    whitening: Float | None = None,
) -> ProjectedPoints:
    """Return the pixels of world points (n, 3), mm, and their derivatives.

    By the first ``terms`` (14 to 17) parameters. ``uv`` (n, 2), px, is subtracted; ``whitening``
    (3, n), 1/px, as in `_model_fit.CameraProblem`, default plain pixels.
    """
    n = len(points_world)
    if uv is None:
        uv = np.zeros((n, 2))
    if whitening is None:
        whitening = np.ones((3, n))
        whitening[1] = 0.0
    residuals, rows = np.empty((2, n)), np.empty((terms, 2, n))
    # Data from files may have another byte order, which the kernel refuses.
    points = np.ascontiguousarray(points_world, dtype=np.float64)
    spots = np.ascontiguousarray(uv, dtype=np.float64)
    project_points_with_jacobian(camera.packed(), points, spots, whitening, residuals, rows)
    return ProjectedPoints(residuals, rows)


def by_point(camera: LensCamera, rows: Float) -> Float:
    """Return d/d(point), (2, 3, n), 1/mm, world: rows of the camera's shift, rotated."""
    rotation = camera.model.T_camera_from_world.rotation
    moved: Float = np.einsum("aun,ab->ubn", rows[3:6], rotation)
    return moved


def project_extended(camera: LensCamera, points_world: Points3) -> Pixels:
    """Return the pixel coordinates (n, 2) of world points (n, 3), mm; infinite behind it."""
    return project_with_jacobian(camera, points_world, N_PARAMETERS).residuals.T


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def spot_rows(
    packed: Float, px: float, py: float, pz: float, u_row: Float, v_row: Float
) -> tuple[float, float, float]:
    """Return depth, u and v of a world point; write d(u) and d(v) by the camera, (17,) each.

    Constant elements must be preset, see `empty_rows`. Nothing is written behind the camera.
    """
    # R X, camera axes, before the translation: lever arm of a camera rotation.
    ax = packed[0] * px + packed[1] * py + packed[2] * pz
    ay = packed[3] * px + packed[4] * py + packed[5] * pz
    az = packed[6] * px + packed[7] * py + packed[8] * pz
    depth = az + packed[11]
    # A point in the camera's plane or behind has no image; written so that NaN also fails.
    if not depth > 0.0:
        return depth, np.inf, np.inf
    # Packed: R (9), t (3), f, Sx, Sy, u0, v0, k1, k2, p1, p2, then k3, s1, s2.
    f, sx, sy = packed[12], packed[13], packed[14]
    k1, k2, p1, p2 = packed[17], packed[18], packed[19], packed[20]
    k3, s1, s2 = packed[21], packed[22], packed[23]
    # Tangents of the angles; x and y are mm on the ideal image.
    tx, ty = (ax + packed[9]) / depth, (ay + packed[10]) / depth
    x, y = f * tx, f * ty
    xx, yy, xy2 = x * x, y * y, 2.0 * x * y
    r2 = xx + yy
    # 1 + k1 r^2 + k2 r^4 + k3 r^6, and d(radial)/dx = x slope: slope is twice the derivative by
    # r^2.
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * k1 + r2 * (4.0 * k2 + 6.0 * k3 * r2)
    # Factors of p2 and p1 along their own axis (Brown); s1, s2 are the thin prism (Weng 1992).
    along_x, along_y = 3.0 * xx + yy, xx + 3.0 * yy
    dx = x * radial + p1 * xy2 + p2 * along_x + s1 * r2
    dy = y * radial + p1 * along_y + p2 * xy2 + s2 * r2
    # x y slope + 2 p1 x + 2 p2 y: d(dx)/dy and d(dy)/dx but for the prism, which adds 2 s1 y to one
    # and 2 s2 x to the other.
    cross = 0.5 * xy2 * slope + 2.0 * (p1 * x + p2 * y)
    ux = sx * (radial + xx * slope + 2.0 * p1 * y + (6.0 * p2 + 2.0 * s1) * x)
    uy = sx * (cross + 2.0 * s1 * y)
    vx = sy * (cross + 2.0 * s2 * x)
    vy = sy * (radial + yy * slope + (6.0 * p1 + 2.0 * s2) * y + 2.0 * p2 * x)
    # Order of the columns: `lens.ALL_PARAMETERS`. By f: x = f tx.
    u_row[6], v_row[6] = ux * tx + uy * ty, vx * tx + vy * ty
    # By the translation: x = f X / Z, so that dx/dX = f / Z and dx/dZ = -x / Z = -(f / Z) tx. The
    # derivative by f along (tx, ty) is the same combination and is reused.
    near = f / depth
    u_row[3], v_row[3] = near * ux, near * vx
    u_row[4], v_row[4] = near * uy, near * vy
    u_row[5], v_row[5] = -near * u_row[6], -near * v_row[6]
    # By a small rotation w of the camera, along its own axes and after R: d(a) = w x a, so the
    # derivative is a x (derivative by the point).
    u_row[0] = ay * u_row[5] - az * u_row[4]
    v_row[0] = ay * v_row[5] - az * v_row[4]
    u_row[1] = az * u_row[3] - ax * u_row[5]
    v_row[1] = az * v_row[3] - ax * v_row[5]
    u_row[2] = ax * u_row[4] - ay * u_row[3]
    v_row[2] = ax * v_row[4] - ay * v_row[3]
    # The pitch is 1 / Sy. Only u has the aspect: u = aspect Sy dx + u0 with Sy = 1 / pitch.
    # Elements 8 and 9, by u0 and v0, are one and stay, as does v by the aspect, zero.
    u_row[7] = dx * sy
    u_row[10], v_row[10] = sx * x * r2, sy * y * r2
    u_row[11], v_row[11] = u_row[10] * r2, v_row[10] * r2
    # The distortion is linear in its coefficients: the derivatives are their factors, in px.
    u_row[12], v_row[12] = sx * xy2, sy * along_y
    u_row[13], v_row[13] = sx * along_x, sy * xy2
    u_row[14], v_row[14] = u_row[11] * r2, v_row[11] * r2
    u_row[15] = sx * r2
    v_row[16] = sy * r2
    return depth, sx * dx + packed[15], sy * dy + packed[16]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def empty_rows() -> tuple[Float, Float]:
    """Return the rows for `spot_rows` with constant elements preset."""
    u_row, v_row = np.zeros(_N_TERMS), np.zeros(_N_TERMS)
    # d(u)/d(u0) and d(v)/d(v0); every other element is zero or written by `spot_rows`.
    u_row[8] = 1.0
    v_row[9] = 1.0
    return u_row, v_row


@njit(cache=True, nogil=True, error_model="numpy")
def project_points_with_jacobian(
    packed: Float, points: Float, uv: Float, whitening: Float, residuals: Float, rows: Float
) -> None:
    """Write whitened misses and their derivatives.

    ``packed`` (24,): `CameraModel.packed`, then k3, s1, s2; ``points`` (n, 3), mm, world; ``uv``
    (n, 2), px; ``whitening`` (3, n), 1/px: lower triangle (00, 10, 11) of each point. Out:
    ``residuals`` (2, n), predicted minus observed, whitened, infinite behind the camera; ``rows``
    (p, 2, n), its derivatives by the first p (14 to 17) of `lens.ALL_PARAMETERS`.
    """
    terms = rows.shape[0]
    u_row, v_row = empty_rows()
    for n in range(points.shape[0]):
        depth, u, v = spot_rows(packed, points[n, 0], points[n, 1], points[n, 2], u_row, v_row)
        if not depth > 0.0:
            # An infinite cost makes the solver reject the step.
            residuals[0, n] = residuals[1, n] = np.inf
            for k in range(terms):
                rows[k, 0, n] = rows[k, 1, n] = 0.0
            continue
        # Whitening by a lower triangle K with K'K the inverse covariance of the spot, 1/px: gives
        # two independent numbers of variance one.
        first, across, second = whitening[0, n], whitening[1, n], whitening[2, n]
        residuals[0, n] = first * (u - uv[n, 0])
        residuals[1, n] = across * (u - uv[n, 0]) + second * (v - uv[n, 1])
        for k in range(terms):
            rows[k, 0, n] = first * u_row[k]
            rows[k, 1, n] = across * u_row[k] + second * v_row[k]
