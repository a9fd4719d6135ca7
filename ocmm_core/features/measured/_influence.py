"""Points that command a fit: leave-one-out influence, by refits.

A gross outlier has so much leverage that it draws the element to itself: its own residual is small
and first-order deletion residuals fail. Suspicious points are therefore left out in truth, one or
two at a time, and the loss of the sum of squares is tested (R. D. Cook and S. Weisberg, Residuals
and Influence in Regression, 1982, 2.2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from operator import attrgetter

import msgspec
import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, nominal_distances
from ocmm_core.features.measured._actual import (
    Touches,
    checked_touches,
    fit_projected,
    fit_touches,
    flattened,
    sign_of,
)
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.shapes import DIRECTION, MINIMUM_POINTS, POINT, Fit, NominalFeature, Shape
from ocmm_core.geometry import Float, Points3
from ocmm_core.measuring import MeasuredPoint

FALSE_ALARM = 1e-5
"""Probability that a good set is questioned; tested again after each touch of each feature."""

LEAST_FOLD = 3.0
"""A point commands a fit if the rms falls so many times without it; else it is an outlier."""

GROSS_MM = 10.0
"""Two points side by side support each other (a dent, a burr), unless they are so far off."""

_PRIOR = 8.0
"""Degrees of freedom of the scatter that is known beforehand."""
_ALL = 24
"""Up to so many points each is left out, else so many suspicious ones."""
_PAIRED = 6
"""Pairs are formed of so many suspicious points of each kind."""
_PAIRS_FROM = 8
_MILD, _LIKELY = 5.0, 4
"""Up to so many times the known scatter first order finds the suspicious points: so many."""
_PLAN_FOLD, _PLAN_OFF = 10.0, 5.0
"""A size is so many times nearer to the plan without a point, and off by so many scatters with it.
"""
_OWN = 1e-12
"""Scatter, relative to the size of the points, below which it is rounding."""


@dataclass(frozen=True, slots=True)
class CommandingPoints:
    """Points without which all others agree far better."""

    numbers: tuple[int, ...]
    """Of the points; rows from 1 if they have no numbers."""
    off: tuple[float, ...]
    """mm, in the same order: distances from the element of the others."""
    rms: float | None
    """mm: of the fit with them; None if there is no fit."""
    rms_without: float
    """mm: of the fit without them."""

    @property
    def fold(self) -> float:
        """Return the ratio of the rms with and without them to two digits; 1 if unknown."""
        if self.rms is None:
            return 1.0
        return float(f"{min(self.rms / max(self.rms_without, 1e-12), 1e6):.2g}")

    @property
    def summary(self) -> str:
        names = ", ".join(map(str, self.numbers))
        off = ", ".join(f"{abs(one):.4g}" for one in self.off)
        rms, less = self.rms or 0.0, f"{self.rms_without:.4f}"
        if self.rms is None:
            return f"Without point {names} ({off} mm off) the others fit with an rms of {less} mm."
        return (
            f"Without point {names} ({off} mm off) the rms falls {self.fold:.0f}-fold, from "
            f"{rms:.4f} to {less} mm."
        )


def commanding_points(
    refit: Callable[[Points3], Fit],
    shape: Shape,
    points: Points3,
    numbers: Sequence[int],
    known_mm: float = 0.0,
    smallest: float = 0.0,
    offset: float = 0.0,
    planned: tuple[float, float] | None = None,
) -> CommandingPoints | None:
    """Return the one or two points that command a fit; None if none does.

    Parameters
    ----------
    refit
        Fits points by least squares; its FitError counts as no fit.
    numbers
        Of the points.
    known_mm
        Scatter of good points, known beforehand; 0 if unknown: the points alone must tell it.
    smallest
        mm: points less far off the element of the others are never questioned, and a fit with an
        rms below is not examined.
    offset
        mm: of good points from the element (`fit_shape`).
    planned
        mm: half length and half width of a slot or rectangle through the points. A point alone on
        its end draws the end along and leaves small residuals: only the size shows it.
    """
    n, least = len(points), MINIMUM_POINTS[shape]
    if n < least + 2 or shape is Shape.POINT:
        return None
    whole = _fitted(refit, points)
    rms = None if whole is None else float(np.sqrt(np.mean(whole.residuals**2)))
    floor = _OWN * float(np.abs(points - points.mean(axis=0)).max())
    if rms is not None and rms <= max(smallest, floor):
        return None
    squares = None if rms is None else n * rms**2
    tried = _LeaveOut(refit, points, squares, known_mm, floor, offset, planned)
    off_plan = 0.0 if planned is None else np.inf if whole is None else _off_plan(whole, planned)
    strange = off_plan > _PLAN_OFF * known_mm
    middle = np.median(points, axis=0)
    far = np.argsort(-np.linalg.norm(points - middle, axis=1), kind="stable")
    worst = far if whole is None else np.argsort(-_deleted(whole, points), kind="stable")
    # The most suspicious ones first: of either kind in turn.
    rows = list(dict.fromkeys(np.stack([worst, far], axis=1).ravel().tolist()))[:_ALL]
    if rms is not None and rms < _MILD * known_mm and not strange:
        rows = worst[:_LIKELY].tolist()
    singles: list[_LeftOut] = []
    for row in rows:
        one = tried.without((row,))
        singles += [] if one is None else [one]
        # One that leaves no more than is expected, compared with two others: enough is known.
        settled = min(s.squares for s in singles) < n * known_mm**2 if singles else False
        if settled and len(singles) >= _LIKELY - 1 and not strange:
            break
    singles.sort(key=attrgetter("squares"))
    found = tried.best(singles, n)
    if strange:
        near = max(off_plan / _PLAN_FOLD, known_mm) if whole is not None else known_mm
        fits = [
            one for one in singles
            if one.squares <= n * known_mm**2 and one.off_plan <= near
            and abs(one.off[0]) > smallest
            and (rms is None or n * rms**2 > LEAST_FOLD**2 * one.squares)
        ]  # fmt: skip
        if len(fits) == 1:
            return _commanding(fits[0], numbers, n, rms)
    if found is None and n >= max(_PAIRS_FROM, least + 3) and (rms is None or rms > 10 * smallest):
        some = {one.rows[0] for one in singles[:_PAIRED]} | set(far[:_PAIRED].tolist())
        pairs = (tried.without(pair) for pair in combinations(sorted(some), 2))
        found = tried.best(sorted(filter(None, pairs), key=attrgetter("squares")), n * (n - 1) // 2)
        if found is not None and min(np.abs(found.off)) < GROSS_MM and _side_by_side(
            points, found.rows
        ):  # fmt: skip
            return None
    if found is None or min(np.abs(found.off)) <= smallest:
        return None
    less = float(np.sqrt(found.squares / (n - len(found.rows))))
    if rms is not None and rms < LEAST_FOLD * less:
        return None
    return _commanding(found, numbers, n, rms)


def commanding_touches(
    nominal: NominalFeature,
    points: Sequence[MeasuredPoint],
    plane_normal: Float | None,
    known_mm: float,
    smallest: float,
) -> CommandingPoints | None:
    """Return the points of a probed feature that command its fit (`commanding_points`).

    ``plane_normal`` (3,), world, is that of the plane it is projected onto; None without one.
    """
    simple = msgspec.structs.replace(nominal, criterion="least squares")
    try:
        touches = checked_touches(nominal, Touches.of(points, range(len(points))))
        if nominal.shape is Shape.LINE and plane_normal is not None:
            touches, plane_normal = flattened(nominal, touches, plane_normal), None
    except FitError:
        return None

    def refit(tips: Points3) -> Fit:
        own = replace(touches, tips=tips)
        if plane_normal is None:
            return fit_touches(simple, own)
        return fit_projected(simple, own, plane_normal)[0]

    offset = sign_of(nominal) * touches.tip_radius if nominal.shape.spec.ball == "kept" else 0.0
    planned = None
    if nominal.shape in (Shape.ROUND_SLOT, Shape.RECTANGLE) and nominal.length and nominal.width:
        by_ball = sign_of(nominal) * touches.tip_radius
        planned = (0.5 * nominal.length + by_ball, 0.5 * nominal.width + by_ball)
    return commanding_points(
        refit, nominal.shape, touches.tips, touches.numbers, known_mm, smallest, offset, planned
    )


def commanding_rows(
    shape: Shape, points: Points3, *, free: bool = False
) -> CommandingPoints | None:
    """Return the rows, from 1, that command the least-squares fit of points (n, 3), mm."""
    rows = range(1, len(points) + 1)
    return commanding_points(partial(fit_shape, shape, free=free), shape, points, rows)


@dataclass(frozen=True, slots=True)
class _LeftOut:
    rows: tuple[int, ...]
    shape: Shape
    squares: float
    off: tuple[float, ...]
    off_plan: float


def _commanding(
    found: _LeftOut, numbers: Sequence[int], n: int, rms: float | None
) -> CommandingPoints:
    less = float(np.sqrt(found.squares / (n - len(found.rows))))
    return CommandingPoints(tuple(numbers[row] for row in found.rows), found.off, rms, less)


def _off_plan(fit: Fit, planned: tuple[float, float]) -> float:
    """Return the largest difference of the half sizes from the plan, mm."""
    return max(abs(fit.radius - planned[0]), abs(fit.second - planned[1]))


@dataclass(frozen=True, slots=True)
class _LeaveOut:
    """Fits without points, compared with the fit of all."""

    refit: Callable[[Points3], Fit]
    points: Points3
    squares: float | None
    known_mm: float
    floor: float
    offset: float
    planned: tuple[float, float] | None

    def without(self, rows: tuple[int, ...]) -> _LeftOut | None:
        """Return the fit without some points; None if there is none."""
        fit = _fitted(self.refit, np.delete(self.points, list(rows), axis=0))
        if fit is None:
            return None
        off = _distances(fit, self.points[list(rows)]) - self.offset
        squares = float(fit.residuals @ fit.residuals)
        off_plan = 0.0 if self.planned is None else _off_plan(fit, self.planned)
        return _LeftOut(rows, fit.shape, squares, tuple(off.tolist()), off_plan)

    def best(self, trials: Sequence[_LeftOut], tests: int) -> _LeftOut | None:
        """Return the trial with the least squares left, if it cannot be chance."""
        from scipy.special import fdtrc

        if not trials:
            return None
        one, size = trials[0], len(trials[0].rows)
        loss = (
            float(np.sum(np.square(one.off))) if self.squares is None
            else self.squares - one.squares
        )  # fmt: skip
        left = len(self.points) - size - MINIMUM_POINTS[one.shape]
        weight = _PRIOR if self.known_mm else 0.0
        scatter = (one.squares + weight * self.known_mm**2) / (left + weight)
        ratio = max(loss, 0.0) / size / max(scatter, self.floor**2)
        chance = float(fdtrc(size, left + weight, ratio)) * tests
        # Ties leave open which of the points it is.
        rival = trials[1].squares if len(trials) > 1 else np.inf
        clear = rival > 2.0 * max(one.squares, self.known_mm**2)
        return one if chance < FALSE_ALARM and clear else None


def _fitted(refit: Callable[[Points3], Fit], points: Points3) -> Fit | None:
    try:
        return refit(points)
    except FitError:
        return None


def _deleted(fit: Fit, points: Points3) -> Float:
    """Return the distance of each point from the element of the others in first order, (n,), mm."""
    by_geometry, normals = distance_derivatives(fit, points)
    blocks = np.einsum("kni,ni->nk", fit.jacobian.reshape(-1, len(points), 3), normals)
    own = np.sum(normals**2, axis=1) + np.sum(by_geometry * blocks, axis=1)
    return np.asarray(np.abs(fit.residuals) / np.clip(own, 1e-3, 1.0))


def _distances(fit: Fit, points: Points3) -> Float:
    """Return the distances of points from an element, (k,), mm."""
    if fit.shape is Shape.LINE:
        arms = points - fit.geometry[POINT]
        return np.asarray(np.linalg.norm(np.cross(arms, fit.geometry[DIRECTION]), axis=1))
    return nominal_distances(fit.shape, fit.geometry, points)[0]


def _side_by_side(points: Points3, rows: Iterable[int]) -> bool:
    """Return whether two points are nearer to each other than twice the usual distance."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    first, second = rows
    return bool(apart[first, second] < 2.0 * float(np.median(apart.min(axis=1))))
