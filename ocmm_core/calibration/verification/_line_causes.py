"""Causes of wrong lengths by the lines of a verification: tip, scale, and noise of a tracker.

All lines of a tracker are adjusted together: their places and directions, the scale of the markers,
and the errors of LEDs and ball with the prior of the probe. Errors of near markers are correlated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ocmm_core.calibration import guided, records
from ocmm_core.calibration.verification._state import Taken, VerificationState
from ocmm_core.camera import project
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.tracking import solve, tip_sensitivities, triangulate

SCALE = "verification.scale"
TIP = "verification.tip"
_CAUSE_SIGMAS = 5.0
"""Significance from which a cause is named."""

_TIP_MM = 0.030
"""A smaller tip displacement does not explain a length error of 60 um."""

_SHARE = 0.5
"""Fraction of the misfit that a cause must explain."""

_CHANCE = 0.999
"""Of scatter by the noise alone."""
_SIGMAS = 3.3
_STEP = 1e-3


class TrackerLines:
    """The adjusted lines of a tracker."""

    def __init__(self, state: VerificationState) -> None:
        self._state = state
        rows, values = _rows_of(state)
        step, *_ = np.linalg.lstsq(rows, values)
        left = float(np.sum((values - rows @ step) ** 2))
        free = len(values) - int(np.linalg.matrix_rank(rows))
        factor = max(1.0, left / free)
        variance = np.linalg.pinv(rows.T @ rows)[-1, -1] * factor
        certificate = max(
            check.expanded_mm / check.certified_mm / 2.0
            for line in range(len(state.plans)) for check in state.lengths(line)[-1:]
        )  # fmt: skip
        self.scale = records.ScaleError(
            relative=float(step[-1]), sigma=float(np.hypot(np.sqrt(variance), certificate))
        )
        self._times = np.sqrt(left / free)
        self._scattered = left > scipy.stats.chi2.ppf(_CHANCE, free)

    def findings(self) -> list[records.Finding]:
        """Return the objections to the scale, and to places that scatter too much."""
        markers, scale = self._state.rig.markers, self.scale
        assert markers is not None  # noqa: S101 - only of trackers
        found = []
        stated = markers.document.noise.scale_sigma
        if abs(scale.relative) > _SIGMAS * np.hypot(scale.sigma, stated):
            found.append(
                records.Finding(
                    SCALE,
                    f"All lengths are wrong by the same {1e6 * scale.relative:+.0f} um/m, with a "
                    f"standard uncertainty of {1e6 * scale.sigma:.0f} um/m.",
                    "Check that bar, length and temperature match the bar document. If they do, "
                    "correct the scale (ocmm calibrate scale), and verify with another bar.",
                    refuses=True,
                )
            )
        if self._scattered:
            found.append(
                records.Finding(
                    "verification.noise",
                    f"The places of the ball scatter {self._times:.1f} times as much as the noise "
                    "of the tracker explains: U of its points would be too small.",
                    "Calibrate the tracker again, all over its volume; then verify.",
                    refuses=True,
                )
            )
        return found


def _rows_of(state: VerificationState) -> tuple[Float, Float]:
    """Return rows (of lines, probe, then the scale) and values, in sigmas; the prior at the end."""
    lines = [state.line_taken(line) for line in range(len(state.plans))]
    nests, geometry = state.begun.bar.nests, state.body.geometry_covariance
    spread = np.linalg.cholesky(geometry + 1e-12 * np.eye(len(geometry)))
    n_own, rows, values = 5 * len(lines), [], []
    for line, taken in enumerate(lines):
        tips, by_scale = [one.tip for one in taken], [_by_scale(one, state) for one in taken]
        along, first = unit(tips[-1] - tips[0]), taken[0]
        for nest, one in enumerate(taken):
            place = state.begun.bar.artefact.at(nests[nest] - nests[0], state.begun.temperature)[0]
            row = np.zeros((3, n_own))
            row[:, 5 * line : 5 * line + 3] = np.eye(3)
            row[:, 5 * line + 3 : 5 * line + 5] = place * np.column_stack(perpendicular_pair(along))
            by_probe = one.rest.touch.by_geometry - first.rest.touch.by_geometry
            slope = by_scale[nest] - by_scale[0]
            rows.append(np.hstack([row, by_probe @ spread, slope[:, None]]))
            values.append(one.tip - tips[0] - place * along)
    white = np.linalg.inv(np.linalg.cholesky(_covariance([one for t in lines for one in t], state)))
    design = white @ np.concatenate(rows)
    prior = np.eye(design.shape[1])[n_own:-1]
    return np.vstack([design, prior]), np.pad(white @ np.concatenate(values), (0, len(prior)))


def _covariance(taken: Sequence[Taken], state: VerificationState) -> Float:
    uv = np.array([guided.from_spots(one.event.uv) for one in taken])
    by_spots = [one.by_spots for one in tip_sensitivities(uv, state.rig, state.body)]
    return guided.noise_covariance(uv, by_spots, [one.event.sigma_px for one in taken], state.rig)


def _by_scale(one: Taken, state: VerificationState) -> Float:
    """Return the derivative (3,), mm, of a tip by the scale of the markers, about the origin."""
    uv, rig = guided.from_spots(one.event.uv), state.rig
    places = (1.0 + _STEP) * triangulate(rig, uv)
    scaled = np.array([project(camera, places) for camera in rig.cameras])
    tip: Float = solve(scaled[None], rig, state.body, one.event.sigma_px).tip_world[0]
    return (tip - one.tip) / _STEP


def culprits(state: VerificationState) -> list[records.Finding]:
    """Return the single causes that explain the length errors."""
    rows, values, n_own = _system(state)
    own = rows[:, :n_own]
    alone = _misfit(own, values)
    found = []
    tip = rows[:, n_own : n_own + 3]
    step, sigma, left = _best(own, tip, values)
    size = float(np.linalg.norm(step))
    if size > max(_TIP_MM, _CAUSE_SIGMAS * sigma) and left < (1.0 - _SHARE) * alone:
        found.append(
            records.Finding(
                TIP,
                f"The lengths fit if the ball is {1e3 * size:.0f} um from its recorded position "
                "in the probe: another or a bent stylus.",
                "Check the tip, or confirm which one is mounted; then verify again.",
                refuses=True,
            )
        )
    scale, sigma, left = _best(own, rows[:, n_own + 3 :], values)
    if abs(scale[0]) > _CAUSE_SIGMAS * sigma and left < (1.0 - _SHARE) * alone and not found:
        found.append(
            records.Finding(
                SCALE,
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
            place = bar.artefact.at(bar.nests[nest] - bar.nests[0], state.begun.temperature)[0]
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
    """Return the parameters of a cause, their largest sigma, and the remaining misfit."""
    rows = np.hstack([own, extra])
    step = np.asarray(np.linalg.lstsq(rows, values)[0], dtype=np.float64)
    left = float(np.sum((values - rows @ step) ** 2))
    k = extra.shape[1]
    covariance = np.linalg.pinv(rows.T @ rows)[-k:, -k:]
    sigma = np.sqrt(np.linalg.eigvalsh(covariance)[-1] * max(1.0, left / max(len(values), 1)))
    return step[-k:], float(sigma), left
