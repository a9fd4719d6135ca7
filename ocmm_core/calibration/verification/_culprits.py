"""What would explain a verification that failed: another tip, or a wrong scale.

The ball of line i rests at p_i + s_j u_i in nest j, s_j as certified. A tip that stands elsewhere
in the probe by d moves it by R_ij d, so that lines bend as the probe is turned; a wrong scale of
the calibration or of the certificate stretches all of them alike. Each is a linear least-squares
problem with what every line needs of its own, place and direction.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.verification._state import VerificationState
from ocmm_core.geometry import Float, perpendicular_pair, unit

TIP = "verification.tip"
_SIGMAS = 5.0
"""A culprit is named from here on."""

_TIP_MM = 0.030
"""A tip that is nearer to its place is not the reason why a length of 60 um fails."""

_SHARE = 0.5
"""Of the misfit that a culprit must explain."""


def culprits(state: VerificationState) -> list[Finding]:
    """Return what explains the errors of the lengths; empty where nothing does alone."""
    rows, values, n_own = _system(state)
    own = rows[:, :n_own]
    alone = _misfit(own, values)
    found = []
    tip = rows[:, n_own : n_own + 3]
    step, sigma, left = _best(own, tip, values)
    size = float(np.linalg.norm(step))
    if size > max(_TIP_MM, _SIGMAS * sigma) and left < (1.0 - _SHARE) * alone:
        found.append(
            Finding(
                TIP,
                f"The lengths fit if the ball is {1e3 * size:.0f} um from its recorded position "
                "in the probe: another or a bent stylus.",
                "Check the tip, or confirm which one is mounted; then verify again.",
                refuses=True,
            )
        )
    scale, sigma, left = _best(own, rows[:, n_own + 3 :], values)
    if abs(scale[0]) > _SIGMAS * sigma and left < (1.0 - _SHARE) * alone and not found:
        found.append(
            Finding(
                "verification.scale",
                f"All lengths are wrong by the same {1e6 * scale[0]:+.0f} um/m.",
                "Check that bar, length and temperature match the bar document. If they do, the "
                "scale of the calibration is wrong: calibrate again.",
                refuses=True,
            )
        )
    return found


def _system(state: VerificationState) -> tuple[Float, Float, int]:
    """Return rows and values in sigmas; columns of each line, then of the tip, then the scale."""
    bar, lines = state.begun.bar, len(state.plans)
    n_own = 5 * lines
    rows, values = [], []
    for line in range(lines):
        taken = state.line_taken(line)
        tips = state.line_tips(line)
        along = unit(tips[-1] - tips[0])
        across = np.column_stack(perpendicular_pair(along))
        for nest, one in enumerate(taken):
            place = bar.artefact.at(bar.nests[nest] - bar.nests[0], state.begun.temperature_c)[0]
            row = np.zeros((3, n_own + 4))
            row[:, 5 * line : 5 * line + 3] = np.eye(3)
            row[:, 5 * line + 3 : 5 * line + 5] = place * across
            row[:, n_own : n_own + 3] = -one.rest.touch.rotation_world_from_probe
            row[:, n_own + 3] = place * along
            white = np.linalg.inv(np.linalg.cholesky(one.rest.touch.noise))
            rows.append(white @ row)
            values.append(white @ (one.tip - tips[0] - place * along))
    return np.concatenate(rows), np.concatenate(values), n_own


def _misfit(rows: Float, values: Float) -> float:
    step = np.linalg.lstsq(rows, values)[0]
    return float(np.sum((values - rows @ step) ** 2))


def _best(own: Float, extra: Float, values: Float) -> tuple[Float, float, float]:
    """Return the unknowns of a culprit, their largest sigma, and the misfit that is left."""
    rows = np.hstack([own, extra])
    step = np.asarray(np.linalg.lstsq(rows, values)[0], dtype=np.float64)
    left = float(np.sum((values - rows @ step) ** 2))
    k = extra.shape[1]
    covariance = np.linalg.pinv(rows.T @ rows)[-k:, -k:]
    sigma = np.sqrt(np.linalg.eigvalsh(covariance)[-1] * max(1.0, left / max(len(values), 1)))
    return step[-k:], float(sigma), left
