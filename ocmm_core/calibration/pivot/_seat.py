"""Wander of the ball in its seat: worn cone, ball with lobes or dirt.

In a worn cone the centre of the ball is a smooth function of the tilt in the world; with lobes or
dirt it is one of the place of the ball, in probe coordinates, that rests in the cone. Each model is
fitted to the tips of single frames next to the common place, the tip, and the errors of the cameras
by their covariance. Sensor patterns enter by drawn fields, carried through the same fit.

A wander in proportion to the tilt resembles a longer stylus: the tip follows it. If the frames
suggest one, or would not reveal it, its second moment is a part of the covariance of the tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.pivot._bundle import PivotState
from ocmm_core.calibration.pivot._covariance import attitude_blocks
from ocmm_core.calibration.pivot._guards import CameraTips
from ocmm_core.calibration.pivot._robust import FreePoses
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Float, Int, perpendicular_pair, unit

CHANCE = 1e-4
"""Probability of each of three tests on an honest sweep."""
_LEAST_FRAMES = 50
_BLOCKS = 20
_WORN_MM = 0.05
"""Standard deviation of the wander of any cone per radian of tilt and axis."""
_SUSPECT, _GOOD_MM = 0.02, 0.008
"""Chance below which the wander that may remain is a part of the uncertainty; one if the sweep
would not reveal a wander beyond that of the tip, or of some micrometres."""
_OPEN_MM = 0.02
"""Standard uncertainty of the tip by the wander of any cone above which a sphere is needed."""
CLEAR = 12.0
"""Difference of chi-square at which a model is preferred: odds of 400 to 1."""
_RANK = 0.01
"""Part of a model that common unknowns must leave. Rotations have the noise of the same spots:
smaller parts consist of it.
"""


@dataclass(frozen=True, slots=True)
class SeatWander:
    """Wander of the ball in a sweep."""

    of_tip: Float
    """(3, 3), mm^2, body: second moment of the error of the tip by wander that may remain."""
    worth: float
    """Gain of chi-square of the best model, less twice its unknowns; 0 if within chance."""
    finding: Finding | None

    def among(self, accused: Sequence[Finding], worth: float, jump: float) -> list[Finding]:
        """Return the findings on the seat and other elements: those that explain most.

        Lenses and LEDs imitate a wander of the ball, and it them. ``worth`` is the gain of the
        ``accused``, ``jump`` that of a moved cone, likewise.
        """
        if self.finding is None:
            return list(accused)
        if not self.finding.refuses:
            return [self.finding, *accused]
        rivals = [one for one in accused if one.refuses]
        if jump > self.worth or (rivals and worth > self.worth + CLEAR):
            return list(accused)
        if rivals and worth > self.worth - CLEAR:
            rival = rivals[0]
            what = f"{self.finding.what} It fits as well that: {rival.what}"
            return [
                replace(self.finding, what=what, remedy=f"{self.finding.remedy} {rival.remedy}")
            ]
        return [self.finding]


@dataclass(frozen=True, slots=True)
class _Rest:
    """Whitened tips and models without the part that common unknowns and cameras explain."""

    tips: Float
    """(m,)."""
    drawn: Float
    """(m, k): by sensor patterns."""
    common: Float
    """(m, q): orthonormal basis of that part; the last rows are priors."""
    solve: Float
    """(q, q): common unknowns from their coefficients in the basis."""

    def part(self, rows: Float) -> Float:
        """Return rows (m', k) without the common part; their priors are zero."""
        left: Float = -self.common @ (self.common[: len(rows)].T @ rows)
        left[: len(rows)] += rows
        return left

    def common_of(self, rows: Float) -> Float:
        """Return the common unknowns (q, k) that imitate rows."""
        return self.solve @ (self.common[: len(rows)].T @ rows)


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A model of wander."""

    gain: float
    """Chi-square of no wander."""
    dof: int
    chance: float
    rms: float
    """mm: of the shifts of the ball that no tip imitates."""


def examine_seat(
    free: FreePoses, state: PivotState, frames: Int, by_cameras: CameraTips, slack_mm: float,
    tip_sigma: float, *, pattern: bool,
) -> SeatWander:  # fmt: skip
    """Return the wander of the ball over ``frames`` (n,), indices into the sweep.

    ``state`` is the minimum; ``by_cameras`` are shifts of the tips of some of the frames;
    ``tip_sigma``, mm, is the uncertainty of the tip without wander. Over a sensor ``pattern``, few
    sweeps below 45 degrees reveal a wander of 0.05 mm a radian: they are accepted with a warning.
    """
    frames = frames[by_cameras.frames]
    good = free.solved[frames] & np.isfinite(by_cameras.shifts).all(axis=(1, 2))
    good &= np.isfinite(by_cameras.by_pattern).all(axis=(1, 2))
    frames = frames[good]
    if len(frames) < _LEAST_FRAMES:
        return SeatWander(np.zeros((3, 3)), 0.0, None)
    rotations = free.rotations[frames]
    spread = free.covariances[frames] + slack_mm**2 * np.eye(3)
    roots = np.linalg.cholesky(np.linalg.inv(spread)).transpose(0, 2, 1)
    off = (free.tips[frames] - state.centre)[..., None]
    place = np.broadcast_to(np.eye(3), rotations.shape)
    rest = _without_common(
        roots, off, by_cameras.by_pattern[good], np.concatenate([place, rotations], axis=2),
        by_cameras.shifts[good],
    )  # fmt: skip
    handle = unit(state.arms.mean(axis=0))
    cells = attitude_blocks(rotations @ handle)
    axis = unit(rotations.mean(axis=0) @ handle)
    tilts = rotations @ handle @ np.column_stack(perpendicular_pair(axis))
    contacts = rotations.transpose(0, 2, 1) @ axis @ np.column_stack(perpendicular_pair(handle))
    models = (_columns(tilts, 3), _columns(contacts, 3), _columns(tilts, 1))
    fits = cone_fit, ball_fit, slope = [_fit(rest, roots, model, cells) for model in models]
    best = min(fits, key=lambda one: one.chance)
    any_cone, hidden = _may_remain(rest, roots, models[2])
    unseen = 0.0 if pattern else hidden / max(tip_sigma, _GOOD_MM)
    of_tip = any_cone if slope.chance < _SUSPECT * max(1.0, 8.0 * unseen**6) else np.zeros((3, 3))
    if best.chance > CHANCE:
        size = float(np.sqrt(np.trace(any_cone if pattern else of_tip)))
        return SeatWander(of_tip, 0.0, _unproven(size))
    worth = max(one.gain - 2.0 * one.dof for one in fits)
    return SeatWander(of_tip, worth, _finding(cone_fit, ball_fit, best.rms))


def _unproven(size: float) -> Finding | None:
    """Return the finding on a wander of a cone that the sweep would not reveal."""
    if size <= _OPEN_MM:
        return None
    return Finding(
        "pivot.seat_open",
        f"The sweep would not reveal a worn cone that shifts the tip by {1e3 * size:.0f} um.",
        "Sweep wider and longer in a new cone, or qualify the tip on a sphere.",
        # U of the tip includes it: an honest short sweep is not refused for what it cannot show.
        refuses=False,
    )


def _finding(cone: _Fitted, ball: _Fitted, rms: float) -> Finding:
    size = 1e3 * rms
    code, what = (
        "pivot.seat",
        f"The ball shifted by {size:.0f} um (RMS) with the attitude of the probe: the cone is "
        "worn, or the ball has dirt or lobes.",
    )
    if cone.gain - ball.gain > CLEAR:
        code, what = (
            "pivot.worn_cone",
            f"The ball shifted by {size:.0f} um (RMS) with the tilt of the probe: the cone is worn "
            "or dirty.",
        )
    elif ball.gain - cone.gain > CLEAR:
        code, what = (
            "pivot.ball_form",
            f"The ball shifted by {size:.0f} um (RMS) with the place on it that touches the cone: "
            "the ball has dirt or lobes.",
        )
    return Finding(
        code,
        what,
        "Clean cone and ball and sweep again. If it persists, use another cone, mount another "
        "stylus, or qualify the tip on a sphere.",
        refuses=True,
    )


def _without_common(roots: Float, off: Float, drawn: Float, common: Float, cameras: Float) -> _Rest:
    """Return tips (n, 3, 1) and drawn shifts (n, 3, k) without the common part."""
    seen = cameras.shape[2]
    rows = _rows(roots, np.concatenate([common, cameras], axis=2))
    prior = np.hstack([np.zeros((seen, common.shape[2])), np.eye(seen)])
    basis, triangle = np.linalg.qr(np.vstack([rows, prior]))
    rest = _Rest(np.empty(0), np.empty((0, 0)), basis, np.linalg.pinv(triangle, rcond=1e-12))
    tips, fields = (rest.part(_rows(roots, shifts)) for shifts in (off, drawn))
    return replace(rest, tips=tips[:, 0], drawn=fields)


def _fit(rest: _Rest, roots: Float, model: Float, cells: Int) -> _Fitted:
    """Return the fit of a model (n, 3, k); ``cells`` (n,) number alike attitudes."""
    from scipy.special import chdtrc

    rows = _rows(roots, model)
    own = rest.part(rows)
    scale = np.linalg.norm(rows, axis=0)
    left, values, _ = np.linalg.svd(own / scale, full_matrices=False)
    kept = values > _RANK
    left, dof = left[:, kept], int(kept.sum())
    seen = left.T @ rest.tips
    scatter = max(float(rest.tips @ rest.tips - seen @ seen) / (3 * len(roots) - 6 - dof), 1.0)
    # Errors of the sensors and a creeping ball are common to alike attitudes and times.
    errors = (left * (rest.tips - left @ seen)[:, None])[: len(rows)]
    errors = errors.reshape(len(roots), 3, dof).sum(axis=1)
    for numbers in (cells, np.arange(len(roots)) * _BLOCKS // len(roots)):
        sums = np.zeros((numbers.max() + 1, dof))
        np.add.at(sums, numbers, errors)
        scatter = max(scatter, float(np.sum(sums**2)) / dof)
    fields = left.T @ rest.drawn
    covariance = scatter * np.eye(dof) + fields @ fields.T / max(fields.shape[1], 1)
    gain = float(seen @ np.linalg.solve(covariance, seen))
    wander = np.linalg.solve(roots, (left[: len(rows)] @ seen).reshape(-1, 3, 1))
    rms = float(np.sqrt(np.mean(np.sum(wander**2, axis=1))))
    return _Fitted(gain, dof, float(chdtrc(dof, gain)), rms)


def _may_remain(rest: _Rest, roots: Float, model: Float) -> tuple[Float, float]:
    """Return the moment (3, 3) of the tip by wander with the tilt, and sigma if none is seen."""
    rows = _rows(roots, model)
    own, by_size = rest.part(rows), rest.common_of(rows)[3:6]
    information = own.T @ own
    fields = own.T @ rest.drawn
    noise = information + fields @ fields.T / max(fields.shape[1], 1)
    # Patterns correlate the tips: they contain less information than independent ones.
    gain = information @ np.linalg.pinv(noise, hermitian=True)
    covariance = np.linalg.inv(gain @ information + np.eye(model.shape[2]) / _WORN_MM**2)
    size = covariance @ (gain @ (own.T @ rest.tips))
    hidden = by_size @ covariance @ by_size.T
    return hidden + np.outer(by_size @ size, by_size @ size), float(np.sqrt(np.trace(hidden)))


def _rows(roots: Float, columns: Float) -> Float:
    """Return whitened rows (3 n, k) of columns (n, 3, k)."""
    return (roots @ columns).reshape(3 * len(roots), columns.shape[2])


def _columns(places: Float, degree: int) -> Float:
    """Return a shift along each axis for every power of two coordinates (n, 2): (n, 3, 3 k)."""
    x, y = places.T
    powers = [(i, d - i) for d in range(1, degree + 1) for i in range(d + 1)]
    scalars = np.stack([x**i * y**j for i, j in powers], axis=1)
    columns: Float = np.einsum("nk,ij->nijk", scalars, np.eye(3)).reshape(len(x), 3, -1)
    return columns
