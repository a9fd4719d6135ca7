"""Bundle adjustment of cameras, probe and bars from frames with unknown poses.

A `Prior` defines free unknowns and prior knowledge, so one engine serves all kinds of relocation.
The six unknowns of each frame are eliminated (`_kernel`): time and memory grow linearly with the
number of frames, and 30 to 100 common unknowns remain. The world frame is free: among equivalent
solutions, the one nearest to the last state is chosen, and `relocation` transforms it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.bundle._kernel import back_substitute, miss_frames, schur_reduce_poses
from ocmm_core.calibration.bundle._state import BundleData, BundleState, Columns, Prior
from ocmm_core.geometry import Float

FIRST_DAMPING = 1e-4
LARGEST_DAMPING = 1e6
RELATIVE_DECREASE = 1e-10
ENOUGH = 1e-6
"""Chi-square; smaller decreases correspond to steps of a thousandth of the standard deviations."""

LARGEST_CONDITION = 1e14
"""Of the reduced normal matrix; above, the leading digit of a variance is rounding error."""


_NO_STEPS = np.empty((0, 6))


@dataclass(frozen=True, slots=True)
class _Group:
    """One kind of frames; see `_kernel.eliminate_frames`."""

    factors: Float
    y: Float
    z: Float
    jacobian: Float
    diagonals: Float

    @classmethod
    def empty(cls, n: int, width: int) -> _Group:
        return cls(
            np.empty((n, 6, 6)), np.empty((n, 6, width)), np.empty((n, 6)),
            np.empty((n, 6)), np.empty((n, 6)),
        )  # fmt: skip

    def outputs(self) -> tuple[Float, Float, Float, Float, Float]:
        """Return the arrays in kernel order."""
        return self.factors, self.y, self.z, self.jacobian, self.diagonals

    def reduce(self, normal: Float, gradient: Float) -> None:
        """Subtract the Schur complement of these frames from the common normal equations."""
        width = self.y.shape[2]
        stacked = self.y.reshape(-1, width)
        normal[:width, :width] -= stacked.T @ stacked
        gradient[:width] -= stacked.T @ self.z.reshape(-1)

    def steps(self, step: Float) -> Float:
        """Return the steps (n, 6) of the frames, given that of the common columns."""
        steps = np.empty(self.z.shape)
        back_substitute(self.factors, self.y, self.z, step[: self.y.shape[2]].copy(), steps)
        return steps

    def predicted(self, steps: Float, damping: float) -> float:
        """Return these frames' share of the predicted decrease of chi-square."""
        return float(np.sum(steps * (damping * self.diagonals * steps - self.jacobian)))


@dataclass(frozen=True, slots=True)
class Linearised:
    """Bundle linearised at one state and damping."""

    cost: float
    """Sum of squared residuals including the prior; infinite for an impossible state."""
    normal: Float
    gradient: Float
    """`normal`, `gradient`: (k, k) and (k,) of the common columns, poses not yet eliminated."""
    damping: float
    """Of all diagonals."""
    groups: tuple[_Group, ...]
    """Frames in the air, frames in a seat, then bar by bar."""

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
    """Result of an adjustment."""

    state: BundleState
    cost: float
    """Chi-square including the prior."""
    iterations: int
    converged: bool
    """Whether chi-square cannot decrease further."""


def linearise(data: BundleData, prior: Prior, state: BundleState, damping: float) -> Linearised:
    """Return the normal equations at ``state``, poses eliminated."""
    columns = state.columns
    normal, gradient = np.zeros((columns.count, columns.count)), np.zeros(columns.count)
    packed = state.packed()
    led_columns = columns.of_leds.start if np.isin(prior.free, columns.all_leds()).any() else -1
    # Only frames with a seat involve the columns of the tip and of the seats.
    narrow = columns.of_cameras.stop if led_columns < 0 else columns.of_leds.stop
    kinds = (slice(0, data.waved), narrow), (slice(data.waved, None), columns.of_seats.stop)
    cost = 0.0
    groups = []
    for part, width in kinds:
        groups.append(_Group.empty(len(data.seats[part]), width))
        cost += schur_reduce_poses(
            packed, state.leds, state.tip, state.seats, 1.0 / data.seat_sigma,
            led_columns, columns.of_seats.start,
            data.uv[part], data.weights[part], data.seats[part],
            state.rotations[part], state.origins[part], damping,
            normal, gradient, *groups[-1].outputs(),
        )  # fmt: skip
    for bar in range(columns.bars):
        cost += _eliminate_bar(data, state, packed, bar, damping, normal, gradient, groups)
    cost += _touched_bars(data, state, normal, gradient)
    normal += np.tril(normal, -1).T
    known = state.values() - prior.values
    pull = prior.information @ known
    cost += float(known @ pull)
    return Linearised(
        cost if np.isfinite(cost) else np.inf,
        normal + prior.information,
        gradient + pull,
        damping,
        tuple(groups),
    )


def residuals(data: BundleData, state: BundleState) -> tuple[Float, Float]:
    """Return the residuals of all spots and of the bars' spots, as in `miss_frames`."""
    packed = state.packed()
    of_frames, of_bars = np.empty(data.uv.shape), np.empty(data.bar_uv.shape)
    miss_frames(packed, state.leds, data.uv, state.rotations, state.origins, of_frames)
    for bar in range(state.columns.bars):
        part = data.placements(bar)
        miss_frames(
            packed, state.bar_leds(bar), data.bar_uv[part],
            state.bar_rotations[part], state.bar_origins[part], of_bars[part],
        )  # fmt: skip
    return of_frames, of_bars


def adjust(
    data: BundleData, prior: Prior, start: BundleState, max_iterations: int = 40
) -> BundleMinimum:
    """Return the chi-square minimum from ``start`` (Levenberg-Marquardt), or infinite cost."""
    state, damping = start, FIRST_DAMPING
    here = linearise(data, prior, state, damping)
    converged, iteration = False, 0
    while iteration < max_iterations and np.isfinite(here.cost):
        step, own = _step(here, prior, state)
        small = _predicted(here, step, own) <= RELATIVE_DECREASE * here.cost + ENOUGH
        if small and here.damping <= 1.0:
            converged = True
            break
        iteration += 1
        trial = state.moved(step, np.concatenate(own[:2]), np.concatenate([_NO_STEPS, *own[2:]]))
        # Damping decreases with every accepted step, so this is the required one.
        there = linearise(data, prior, trial, max(0.1 * here.damping, 1e-12))
        if there.cost < here.cost:
            state, here = trial, there
        elif here.damping >= LARGEST_DAMPING:
            break
        else:
            here = linearise(data, prior, state, max(10.0 * here.damping, FIRST_DAMPING))
    return BundleMinimum(state, here.cost, iteration, converged)


def common_covariance(
    data: BundleData, prior: Prior, state: BundleState, considered: Float | None = None
) -> Float | None:
    """Return the covariance (k, k) of the common unknowns, or None if undetermined.

    On average the cameras (and seats) have not moved. ``considered`` (8 C, 8 C): covariance of
    fixed lenses, whose effect on all other unknowns is added (Schmidt's consider covariance).
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
    own = (inverse - pinned) / scale / scale[:, None]
    free, covariance = prior.free, np.zeros((state.columns.count,) * 2)
    if considered is not None:
        lenses = state.columns.of_lenses()
        gain = -own @ here.reduced()[0][np.ix_(free, lenses)]
        covariance[np.ix_(lenses, lenses)] = considered
        covariance[np.ix_(free, lenses)] = gain @ considered
        covariance[np.ix_(lenses, free)] = (gain @ considered).T
        own = own + gain @ considered @ gain.T
    covariance[np.ix_(free, free)] = own
    return 0.5 * (covariance + covariance.T)


def _free_part(
    here: Linearised, prior: Prior, state: BundleState
) -> tuple[Float, Float, Float, Float]:
    """Return normal matrix, gradient and scale of the free columns, and the gauge pin."""
    normal, gradient = here.reduced()
    free = prior.free
    normal = normal[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(normal.diagonal(), 0.0))
    scale[scale == 0.0] = 1.0
    normal = normal / scale / scale[:, None]
    motions = state.world_motions()
    if prior.body_floats:
        motions = np.hstack([motions, state.body_motions()])
    basis = np.linalg.qr(scale[:, None] * motions[free])[0]
    pinned = basis @ basis.T
    return normal + pinned, gradient[free] / scale, scale, pinned


def _step(here: Linearised, prior: Prior, state: BundleState) -> tuple[Float, list[Float]]:
    normal, gradient, scale, _ = _free_part(here, prior, state)
    step = np.zeros(state.columns.count)
    try:
        found = np.linalg.solve(normal, gradient)
    except np.linalg.LinAlgError:
        # A seat that lost all its frames is undetermined: it stays, the rest is solved.
        found = np.linalg.lstsq(normal, gradient, rcond=None)[0]
    step[prior.free] = -found / scale
    return step, [group.steps(step) for group in here.groups]


def _predicted(here: Linearised, step: Float, own: list[Float]) -> float:
    damped = here.damping * here.normal.diagonal() * step
    predicted = float(step @ (damped - here.gradient))
    for group, steps in zip(here.groups, own, strict=True):
        predicted += group.predicted(steps, here.damping)
    return predicted


def _eliminate_bar(
    data: BundleData, state: BundleState, packed: Float, bar: int, damping: float,
    normal: Float, gradient: Float, groups: list[_Group],
) -> float:  # fmt: skip
    """Add the placements of one bar: a probe of two LEDs with unknown distance."""
    columns, part = state.columns, data.placements(bar)
    own = Columns(columns.cameras, leds=2, seats=0, bars=0)
    # Derivatives of camera and LED columns by the common ones.
    follow = np.zeros((own.of_leds.stop, columns.count))
    follow[own.of_cameras, columns.of_cameras] = np.eye(own.of_cameras.stop)
    follow[own.of_leds, columns.of_lengths.start + bar] = (-0.5, 0.0, 0.0, 0.5, 0.0, 0.0)
    own_normal, own_gradient = np.zeros((own.count, own.count)), np.zeros(own.count)
    group = _Group.empty(len(data.bars[part]), own.of_leds.stop)
    cost: float = schur_reduce_poses(
        packed, state.bar_leds(bar), np.zeros(3), np.zeros((0, 3)), 0.0,
        own.of_leds.start, own.of_seats.start,
        data.bar_uv[part], data.bar_weights[part], np.full(len(group.z), -1),
        state.bar_rotations[part], state.bar_origins[part], damping,
        own_normal, own_gradient, *group.outputs(),
    )  # fmt: skip
    own_normal = (own_normal + np.tril(own_normal, -1).T)[: len(follow), : len(follow)]
    normal += np.tril(follow.T @ own_normal @ follow)
    gradient += own_gradient[: len(follow)] @ follow
    groups.append(replace(group, y=group.y @ follow))
    return cost


def _touched_bars(data: BundleData, state: BundleState, normal: Float, gradient: Float) -> float:
    """Add the condition that paired seats are one bar length apart."""
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
        row /= data.touched_sigma
        miss = (distance - state.lengths[bar]) / data.touched_sigma
        total += miss * miss
        normal += np.tril(np.outer(row, row))
        gradient += row * miss
    return total
