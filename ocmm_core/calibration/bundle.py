"""Bundle adjustment of a rig: cameras, probe and bars from frames whose poses nobody knows.

One engine for every kind of relocation: what is free and what is known from before is said by a
`Prior`. The six unknowns of each frame are eliminated (`bundle_kernel`), so that time and memory
grow with the number of frames only, and 30 to 100 common unknowns remain. The world is free: of all
solutions, which differ by a motion of everything, the one nearest to the last state is taken, and
`relocation_frame` moves it where it belongs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.bundle_kernel import eliminate_bars, eliminate_frames, resolve
from ocmm_core.calibration.bundle_state import EXACT_SIGMA, BundleData, BundleState, Prior
from ocmm_core.geometry import Float

FIRST_DAMPING = 1e-4
LARGEST_DAMPING = 1e6
RELATIVE_DECREASE = 1e-10
ENOUGH = 1e-6
"""Chi-square; a step that lowers it by no more is a thousandth of the standard deviations."""

LARGEST_CONDITION = 1e14
"""Of the reduced normal matrix; above, the first digit of a variance is rounding."""


@dataclass(frozen=True, slots=True)
class _Group:
    """Frames or placements of one width; see `bundle_kernel.eliminate_frames`."""

    factors: Float
    y: Float
    z: Float
    slopes: Float
    diagonals: Float
    misses: Float

    @classmethod
    def empty(cls, views: tuple[int, int, int], width: int) -> _Group:
        """Return uninitialised outputs for ``views`` = (frames, cameras, LEDs)."""
        n = views[0]
        return cls(
            np.empty((n, 6, 6)), np.empty((n, 6, width)), np.empty((n, 6)),
            np.empty((n, 6)), np.empty((n, 6)), np.empty((*views, 2)),
        )  # fmt: skip

    def outputs(self) -> tuple[Float, Float, Float, Float, Float, Float]:
        """Return the arrays in the order of the kernel."""
        return self.factors, self.y, self.z, self.slopes, self.diagonals, self.misses

    def reduce(self, normal: Float, gradient: Float) -> None:
        """Take the Schur complement of these frames off the common normal equations."""
        width = self.y.shape[2]
        stacked = self.y.reshape(-1, width)
        normal[:width, :width] -= stacked.T @ stacked
        gradient[:width] -= stacked.T @ self.z.reshape(-1)

    def steps(self, step: Float) -> Float:
        """Return the steps (n, 6) of the frames, given that of the common columns."""
        steps = np.empty(self.z.shape)
        resolve(self.factors, self.y, self.z, step[: self.y.shape[2]].copy(), steps)
        return steps

    def predicted(self, steps: Float, damping: float) -> float:
        """Return what the steps are to lower chi-square by, as far as these frames say."""
        return float(np.sum(steps * (damping * self.diagonals * steps - self.slopes)))


@dataclass(frozen=True, slots=True)
class Linearised:
    """A bundle at one state, with one damping.

    Attributes
    ----------
    cost
        Sum of the squared residuals, of the prior too; infinite where the state is impossible.
    misses, bar_misses
        (n, C, L, 2) and (m, C, 2, 2), predicted minus observed, px; NaN where not used.
    """

    cost: float
    normal: Float
    gradient: Float
    damping: float
    groups: tuple[_Group, _Group, _Group]

    @property
    def misses(self) -> Float:
        """Return those of all frames."""
        return np.concatenate([self.groups[0].misses, self.groups[1].misses])

    @property
    def bar_misses(self) -> Float:
        """Return those of the shown bars."""
        return self.groups[2].misses

    def reduced(self) -> tuple[Float, Float]:
        """Return the normal matrix (k, k) and gradient (k,) of the common columns alone."""
        normal = self.normal.copy()
        normal.flat[:: len(normal) + 1] *= 1.0 + self.damping
        gradient = self.gradient.copy()
        for group in self.groups:
            group.reduce(normal, gradient)
        return normal, gradient


@dataclass(frozen=True, slots=True)
class BundleMinimum:
    """Where an adjustment ended.

    Attributes
    ----------
    state
        The best found.
    cost
        Chi-square there, with the prior's.
    misses, bar_misses
        As in `Linearised`.
    iterations
        Number of steps that were tried.
    converged
        Whether chi-square cannot fall any further.
    """

    state: BundleState
    cost: float
    misses: Float
    bar_misses: Float
    iterations: int
    converged: bool


def linearise(data: BundleData, prior: Prior, state: BundleState, damping: float) -> Linearised:
    """Return the normal equations at ``state``, frames and placements eliminated."""
    columns = state.columns
    normal, gradient = np.zeros((columns.count, columns.count)), np.zeros(columns.count)
    packed, views = state.packed(), data.weights.shape
    leds_free = bool(np.isin(prior.free, np.arange(columns.count)[columns.of_leds]).any())
    width = columns.of_leds.stop if leds_free else columns.of_cameras.stop
    parts = slice(0, data.waved), slice(data.waved, None)
    waved = _Group.empty((data.waved, views[1], views[2]), width)
    seated = _Group.empty((views[0] - data.waved, views[1], views[2]), columns.of_seats.stop)
    cost = 0.0
    for part, group in zip(parts, (waved, seated), strict=True):
        cost += eliminate_frames(
            packed, state.leds, state.tip, state.seats, data.seat_weight,
            columns.of_leds.start if leds_free else -1, columns.of_seats.start,
            data.uv[part], data.weights[part], data.seats[part],
            state.rotations[part], state.origins[part], damping, normal, gradient, *group.outputs(),
        )  # fmt: skip
    shown = _Group.empty((len(data.bars), views[1], 2), columns.count)
    cost += eliminate_bars(
        packed, state.lengths, data.bars, 1.0 / EXACT_SIGMA, columns.of_lengths.start,
        data.bar_uv, data.bar_weights, state.ends, damping, normal, gradient, *shown.outputs(),
    )  # fmt: skip
    normal += np.tril(normal, -1).T
    cost += _touched_bars(data, state, normal, gradient)
    known = state.values() - prior.values
    pull = prior.information @ known
    cost += float(known @ pull)
    return Linearised(
        cost if np.isfinite(cost) else np.inf,
        normal + prior.information,
        gradient + pull,
        damping,
        (waved, seated, shown),
    )


def adjust(
    data: BundleData, prior: Prior, start: BundleState, max_iterations: int = 40
) -> BundleMinimum:
    """Return the minimum of chi-square that is reached from ``start`` (Levenberg-Marquardt).

    A start that is impossible itself is returned with an infinite cost.
    """
    state, damping = start, FIRST_DAMPING
    here = linearise(data, prior, state, damping)
    converged, iteration = False, 0
    while iteration < max_iterations and np.isfinite(here.cost):
        step, own = _step(here, prior, state)
        predicted = _predicted(here, step, own)
        small = predicted <= RELATIVE_DECREASE * here.cost + ENOUGH
        if small and here.damping <= 1.0:
            converged = True
            break
        iteration += 1
        trial = state.moved(step, np.concatenate(own[:2]), own[2])
        # A step that is taken makes the next one bolder, so that this is the damping it needs.
        there = linearise(data, prior, trial, max(0.1 * here.damping, 1e-12))
        if there.cost < here.cost:
            state, here = trial, there
        elif here.damping >= LARGEST_DAMPING:
            break
        else:
            here = linearise(data, prior, state, max(10.0 * here.damping, FIRST_DAMPING))
    return BundleMinimum(state, here.cost, here.misses, here.bar_misses, iteration, converged)


def common_covariance(data: BundleData, prior: Prior, state: BundleState) -> Float | None:
    """Return the covariance (k, k) of the common unknowns; None where they are not determined.

    It is that of a world in which the cameras (and seats) have, on the average, not moved. What is
    not free has no variance in it.
    """
    here = linearise(data, prior, state, 0.0)
    if not np.isfinite(here.cost):
        return None
    normal, _, scale, pinned = _free_part(here, prior, state)
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        return None
    if not np.abs(normal).sum(axis=0).max() * np.abs(inverse).sum(axis=0).max() < LARGEST_CONDITION:
        return None
    inverse -= pinned
    covariance = np.zeros((state.columns.count,) * 2)
    covariance[np.ix_(prior.free, prior.free)] = inverse / scale / scale[:, None]
    return 0.5 * (covariance + covariance.T)


def _free_part(
    here: Linearised, prior: Prior, state: BundleState
) -> tuple[Float, Float, Float, Float]:
    """Return normal matrix, gradient and scale of what is free, and what pins the world in it."""
    normal, gradient = here.reduced()
    free = prior.free
    normal = normal[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(normal.diagonal(), 0.0))
    scale[scale == 0.0] = 1.0
    normal = normal / scale / scale[:, None]
    basis = np.linalg.qr(scale[:, None] * state.world_motions()[free])[0]
    pinned = basis @ basis.T
    return normal + pinned, gradient[free] / scale, scale, pinned


def _step(
    here: Linearised, prior: Prior, state: BundleState
) -> tuple[Float, tuple[Float, Float, Float]]:
    normal, gradient, scale, _ = _free_part(here, prior, state)
    step = np.zeros(state.columns.count)
    step[prior.free] = -np.linalg.solve(normal, gradient) / scale
    waved, seated, shown = here.groups
    return step, (waved.steps(step), seated.steps(step), shown.steps(step))


def _predicted(here: Linearised, step: Float, own: tuple[Float, Float, Float]) -> float:
    """Return by how much chi-square falls if the state moves as the normal equations say."""
    damped = here.damping * here.normal.diagonal() * step
    predicted = float(step @ (damped - here.gradient))
    for group, steps in zip(here.groups, own, strict=True):
        predicted += group.predicted(steps, here.damping)
    return predicted


def _touched_bars(
    data: BundleData, state: BundleState, normal: Float, gradient: Float
) -> float:
    """Add the conditions that pairs of seats are as far apart as their bar is long."""
    columns = state.columns
    total = 0.0
    for first, second, bar in data.touched:
        along = state.seats[second] - state.seats[first]
        distance = float(np.linalg.norm(along))
        row = np.zeros(columns.count)
        seats = row[columns.of_seats]
        seats[3 * first : 3 * first + 3] = -along / distance
        seats[3 * second : 3 * second + 3] = along / distance
        row[columns.of_lengths][bar] = -1.0
        row /= EXACT_SIGMA
        miss = (distance - state.lengths[bar]) / EXACT_SIGMA
        total += miss * miss
        normal += np.outer(row, row)
        gradient += row * miss
    return total
