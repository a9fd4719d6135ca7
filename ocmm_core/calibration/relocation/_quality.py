"""How well cameras measure lengths, from their covariance, and how they measured the bars."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.guided import location_gains
from ocmm_core.calibration.relocation._data import BarResidual, LengthBar, Observations
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, solve, triangulate


def judge_bars(
    rig: Rig, body: ProbeBody, observed: Observations, placements_used: NDArray[np.bool_]
) -> tuple[BarResidual, ...]:
    """Return what the cameras of ``rig`` make of every placement by itself.

    Parameters
    ----------
    placements_used
        Of the shown bars, bar after bar.
    """
    found = []
    used = iter(placements_used)
    for shown in observed.shown_bars:
        for index, (spots, sigma_px) in enumerate(zip(shown.uv, shown.sigma_px, strict=True)):
            ends = triangulate(rig, spots)
            sigma = np.nan
            if np.isfinite(ends).all():
                covariances = sigma_px**2 * location_gains(rig, ends)[1]
                sigma = _length_sigma_of(ends, covariances)
            measured = float(np.linalg.norm(ends[1] - ends[0]))
            found.append(_residual(shown.bar, index, measured, sigma, bool(next(used))))
    for touched in observed.touched_bars:
        for index, names in enumerate(touched.seats):
            pairs = [_seat_alone(rig, body, observed, observed.seats.index(n)) for n in names]
            ends, covariances = (np.stack(parts) for parts in zip(*pairs, strict=True))
            measured = float(np.linalg.norm(ends[1] - ends[0]))
            sigma = _length_sigma_of(ends, covariances)
            found.append(_residual(touched.bar, index, measured, sigma, used=True))
    return tuple(found)


def _residual(
    bar: LengthBar, placement: int, measured: float, sigma: float, used: bool
) -> BarResidual:
    return BarResidual(bar.name, placement, measured, measured - bar.length, sigma, used)


def _seat_alone(
    rig: Rig, body: ProbeBody, observed: Observations, seat: int
) -> tuple[Float, Float]:
    """Return mean (3,), mm, and covariance (3, 3) of the tips in one seat."""
    mine = observed.frames.seats == seat
    sigmas = observed.frames.sigma_px[mine]
    # Each frame has its own sigma; the unit of the solution is the smallest of them.
    unit_px = float(sigmas.min())
    batch = solve(observed.frames.uv[mine], rig, body, unit_px)
    solved = batch.status == 0
    growth = (sigmas / unit_px)[:, None, None] ** 2
    spread = growth * batch.tip_covariance + observed.seat_sigma**2 * np.eye(3)
    count = int(solved.sum())
    if not count:
        return np.full(3, np.nan), np.full((3, 3), np.nan)
    return batch.tip_world[solved].mean(axis=0), spread[solved].sum(axis=0) / count**2


def _length_sigma_of(ends: Float, covariances: Float) -> float:
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    return float(np.sqrt(along @ covariances.sum(axis=0) @ along))
