"""Frame of a zone (pose, free motions, derivatives by the points), and the smallest zone.

The greatest of many deviations is minimised over the free motions. Deviations of surface points are
numbers, those of axes are vectors whose length counts. Both are solved by linear programs about the
present place (sequential linear programming, as in D. Zhang, X. Jiang et al., Precision Eng., and
NIST's minimum-zone references); lengths are bounded by their components along directions added on
demand. The multipliers of the last program are the weights of the contact points: by the envelope
theorem they are the derivative of the smallest zone by the deviations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.errors import FitError
from ocmm_core.geometry import Float, Int, RigidTransform, rotation_from_vector, skew
from ocmm_core.measuring import Rows

BEST_FIT = "best fit"
"""Name of a frame set by the toleranced points alone."""


@dataclass(frozen=True, slots=True)
class ZoneFrame:
    """A frame with its derivatives by the points."""

    T_frame_from_world: RigidTransform
    by_coordinates: Rows
    """6 rows, rad over mm, by every coordinate: a point x moves by ``turn x x + shift``."""
    motions: Float
    """(6, k): free motions, in the same form."""
    words: str

    def moved(self, motion: Float) -> ZoneFrame:
        """Return the frame after an open motion (k,)."""
        twist = self.motions @ motion
        return self.after(RigidTransform(rotation_from_vector(twist[:3]), _shift(twist)))

    def after(self, further: RigidTransform) -> ZoneFrame:
        """Return the frame moved further, by a motion that preserves the free motions."""
        return ZoneFrame(
            further.compose(self.T_frame_from_world),
            _transported(further, self.by_coordinates),
            self.motions,
            self.words,
        )

    def point_derivative(self, point_frame: Float, by_coordinates_world: Rows) -> Rows:
        """Return the derivatives of a point in the frame, 3 rows, from those in the world."""
        rotation = self.T_frame_from_world.rotation
        by_frame = -skew(point_frame) @ self.by_coordinates[:3] + self.by_coordinates[3:]
        return rotation @ by_coordinates_world + by_frame

    def turning(self) -> ZoneFrame:
        """Return the rotational part of the frame, which acts on directions."""
        motions = self.motions.copy()
        motions[3:] = 0.0
        turns = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return ZoneFrame(
            RigidTransform(self.T_frame_from_world.rotation, np.zeros(3)),
            turns @ self.by_coordinates,
            motions[:, np.any(motions != 0.0, axis=0)],
            self.words,
        )

    def with_shifts(self) -> ZoneFrame:
        """Return the frame with free shifts in all directions, for zones of orientation."""
        turning = self.motions[:, np.any(self.motions[:3] != 0.0, axis=0)].copy()
        turning[3:] = 0.0
        shifting = np.vstack([np.zeros((3, 3)), np.eye(3)])
        return ZoneFrame(
            self.T_frame_from_world, self.by_coordinates, np.hstack([turning, shifting]), self.words
        )


def _shift(twist: Float) -> Float:
    """Return the shift (3,) of a finite motion: the turn about the twist's own axis."""
    turn, shift = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    k = skew(turn)
    if angle < 1e-6:
        return np.asarray(shift + 0.5 * k @ shift, dtype=np.float64)
    a = (1.0 - np.cos(angle)) / angle**2
    b = (angle - np.sin(angle)) / angle**3
    return np.asarray(shift + a * k @ shift + b * k @ k @ shift, dtype=np.float64)


def free_frame(T_frame_from_world: RigidTransform, middle_world: Float) -> ZoneFrame:
    """Return an unconstrained frame; its small rotations are about a point (3,), mm, world."""
    middle = T_frame_from_world.apply(middle_world)
    motions = np.eye(6)
    motions[3:, :3] = skew(middle)
    return ZoneFrame(T_frame_from_world, Rows.nothing(6), motions, BEST_FIT)


def moved_geometry(
    geometries: Mapping[str, Float], name: str, k: int, step: float
) -> dict[str, Float]:
    """Return the geometries with one entry of one changed; directions stay unit vectors."""
    moved = geometries[name].copy()
    moved[k] += step
    for part in (slice(3, 6), slice(9, 12)):
        length = float(np.linalg.norm(moved[part]))
        if part.start <= k < part.stop and length > 0.0:
            moved[part] /= length
    return {**geometries, name: moved}


def _transported(further: RigidTransform, twists: Rows) -> Rows:
    """Return small motions, 6 rows, as seen after a further motion of the frame."""
    rotation, nothing = further.rotation, np.zeros((3, 3))
    by_twist = np.block([[rotation, nothing], [skew(further.translation) @ rotation, rotation]])
    seen: Rows = by_twist @ twists
    return seen


_STEPS = 60
_CONVERGED = 1e-8
"""Relative gain of a step at convergence."""
_NULL = 1e-7
"""Relative effect of motions that counts as zero."""
_FIRST_TRUST_MM = 1.0
_LEAST_TRUST_MM = 1e-11
_HALF_FANS = 8
"""Initial directions per half turn that bound a length."""


@dataclass(frozen=True, slots=True)
class Smallest:
    motion: Float
    """(k,): the free parameters."""
    value: float
    """mm: the greatest deviation."""
    shares: Float
    """(m,): weights of deviations (signed) or ends of axes, in order; they add up to one."""


Deviations = Callable[[Float], tuple[Float, Float]]
"""Parameters (k,) to deviations, derivatives: (m,), (m, k) or vectors (m, d), (m, d, k)."""


def smallest_zone(deviations: Deviations, size: int) -> Smallest:
    """Return the motion (size,), from zero, of least greatest deviation (m,), mm; else FitError."""

    def as_vectors(motion: Float) -> tuple[Float, Float]:
        values, jacobian = deviations(motion)
        return values[:, None], jacobian[:, None, :]

    found = smallest_length(as_vectors, size)
    signs = np.where(deviations(found.motion)[0] < 0.0, -1.0, 1.0)
    return Smallest(found.motion, found.value, signs * found.shares)


def smallest_length(deviations: Deviations, size: int) -> Smallest:
    """Return the motion that minimises the longest vector deviation; see `smallest_zone`."""
    motion = np.zeros(size)
    vectors, jacobian = deviations(motion)
    lengths = np.linalg.norm(vectors, axis=1)
    value = float(lengths.max())
    shares = _one_hot(lengths)
    if size == 0:
        return Smallest(motion, value, shares)
    cuts = _first_cuts(vectors.shape[1], len(vectors))
    trust = _FIRST_TRUST_MM
    for _ in range(_STEPS):
        cuts = _with_present(cuts, vectors)
        step, bound, duals = _program(cuts, vectors, jacobian, trust)
        moved = motion + step
        new_vectors, new_slopes = deviations(moved)
        new_value = float(np.linalg.norm(new_vectors, axis=1).max())
        gain, hoped = value - new_value, value - bound
        shares = duals
        if hoped <= _CONVERGED * value + _LEAST_TRUST_MM:
            return Smallest(motion, value, shares)
        if gain > 0.0:
            motion, vectors, jacobian, value = moved, new_vectors, new_slopes, new_value
        else:
            # Tangents of the lengths at the tried place prevent its repetition.
            cuts = _with_present(cuts, vectors + jacobian @ step)
        trust = 2.0 * trust if gain > 0.5 * hoped else 0.25 * trust if gain < 0.1 * hoped else trust
        if trust < _LEAST_TRUST_MM:
            return Smallest(motion, value, shares)
    raise FitError(
        "characteristic.zone",
        "Minimum zone not found: the search did not converge.",
        "Check that the points belong to the feature, and name datums that constrain it.",
    )


def _one_hot(lengths: Float) -> Float:
    shares = np.zeros(len(lengths))
    shares[int(np.argmax(lengths))] = 1.0
    return shares


@dataclass(frozen=True, slots=True)
class _Cuts:
    """Directions (c, d), unit, along which the vectors of rows (c,) are bounded."""

    rows: Int
    directions: Float


def _first_cuts(dimension: int, count: int) -> _Cuts:
    if dimension == 2:
        turn = np.arange(2 * _HALF_FANS) * np.pi / _HALF_FANS
        fan = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    else:
        fan = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return _Cuts(np.repeat(np.arange(count), len(fan)), np.tile(fan, (count, 1)))


def _with_present(cuts: _Cuts, vectors: Float) -> _Cuts:
    """Return the cuts and those along the present vectors; numbers have only two directions."""
    if vectors.shape[1] == 1:
        return cuts
    lengths = np.linalg.norm(vectors, axis=1)
    rows = np.flatnonzero(lengths > 1e-12)
    return _Cuts(
        np.concatenate([cuts.rows, rows]),
        np.vstack([cuts.directions, vectors[rows] / lengths[rows, None]]),
    )


def _program(
    cuts: _Cuts, vectors: Float, jacobian: Float, trust: float
) -> tuple[Float, float, Float]:
    """Return the best step (k,) within ``trust``, its predicted bound, and the weights (m,)."""
    rows = cuts.rows
    now = np.sum(cuts.directions * vectors[rows], axis=1)
    by_step = np.einsum("cd,cdk->ck", cuts.directions, jacobian[rows])
    # Motions without effect are excluded: a program would be unbounded.
    _, strengths, ways = np.linalg.svd(by_step, full_matrices=False)
    kept = ways[strengths > _NULL * max(float(strengths[0]), 1e-12)]
    size = len(kept)
    # The solver keeps constraints to 1e-7: negligible in units of the zone.
    scale = max(float(now.max()), _LEAST_TRUST_MM)
    answer = scipy.optimize.linprog(
        np.append(np.zeros(size), 1.0),
        A_ub=np.column_stack([by_step @ kept.T, -np.ones(len(now))]),
        b_ub=-now / scale,
        bounds=[(-trust / scale, trust / scale)] * size + [(None, None)],
        method="highs",
    )
    if answer.x is None:
        raise FitError(
            "characteristic.zone",
            "Minimum zone not found: its linear program has no solution.",
            "Check that the points belong to the feature.",
        )
    duals = -np.asarray(answer.ineqlin.marginals, dtype=np.float64)
    shares = np.bincount(rows, weights=duals, minlength=len(vectors)).astype(np.float64)
    step = scale * np.asarray(answer.x[:-1], dtype=np.float64) @ kept
    return step, scale * float(answer.x[-1]), shares
