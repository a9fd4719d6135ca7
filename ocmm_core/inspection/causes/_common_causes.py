"""Errors shared by a whole job: the ball, the part's temperature, the frame, the noise.

Each is accepted only if several unrelated features show it and none contradicts it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.causes._deviations import (
    CommonPattern,
    TouchedSurface,
    misfits_in,
    rigid,
    surfaces_of,
    with_ball,
    with_growth,
)
from ocmm_core.inspection.evaluation import EvaluatedJob, whereabouts
from ocmm_core.tolerances.uncertainty import FormSample

STEEL_PER_K = 11.5e-6
"""Assumed expansion if that of the part is unknown, 1/K."""

_LIMIT_K = 40.0
"""A larger temperature difference is implausible: something else is wrong."""
_SURE = 6.0
"""Standard uncertainties by which a pattern must differ from zero."""
_REMAINS = 0.75
"""Share of the misfit that may remain unexplained with a pattern."""
_GAIN, _MANY = 0.3, 3
"""Relative gain of a witness of a pattern; and witnesses required per feature made worse."""
_FOLLOWS, _STRAYS = 1.5, 2.5
"""Misfit over the usual one, up to which a feature follows a pattern; beyond which not."""
_LEAST_WITNESSES, _LEAST_SIZES = 2, 3
_NOTHING = 1e-12
_NOISY = 5.0
"""Squared scatter relative to the noise, beyond which points scatter for a reason."""


@dataclass(frozen=True, slots=True)
class Common:
    """Common errors of the features of a job."""

    surfaces: tuple[TouchedSurface, ...]
    """Accepted touches, without suspects of their own feature."""
    place: CommonPattern
    """Pose of the nominals supported by most features, with misfits."""
    scale: float
    """mm: usual misfit of features that follow the best pattern."""
    ball: float | None = None
    """mm: excess of the ball over its assumed size; None without evidence."""
    both_sides: bool = False
    """Inner and outer features agree on the ball."""
    growth: float | None = None
    """Relative excess of the part over its nominals; None without evidence."""
    shifted: float | None = None
    """mm: error of the plan's frame at the features; None if none."""

    def stands_out(self, name: str) -> bool:
        """Return whether a feature contradicts the others."""
        return self.place.misfits.get(name, 0.0) > _STRAYS * self.scale


def common_causes(job: EvaluatedJob, left_out: Collection[int]) -> Common | None:
    """Return the common errors of features; None if the pose is unknown. `left_out`: outliers."""
    found = whereabouts(job.plan, job.found)
    surfaces = surfaces_of(job.actual, left_out)
    if found is None or not surfaces:
        return None
    start = found.T_nominal_from_world
    plain, ball, growth = (fit(surfaces, start) for fit in (rigid, with_ball, with_growth))
    place, scale = plain, plain.scale()
    by_ball = _explains(plain, ball) and _is_ball(plain, ball, surfaces)
    by_growth = _explains(plain, growth) and abs(growth.amount) < _LIMIT_K * expansion(job)
    if by_ball and by_growth:
        least = min(ball.scale(), growth.scale())
        by_ball = ball.unexplained(least) <= growth.unexplained(least)
        by_growth = not by_ball
    common = by_ball or by_growth
    if common:
        place = ball if by_ball else growth
        scale = place.scale()
    return Common(
        surfaces=surfaces,
        place=place,
        scale=scale,
        ball=ball.amount if by_ball else None,
        both_sides=by_ball and len({_is_inner(item) for item in _sized(surfaces)}) > 1,
        growth=growth.amount if by_growth else None,
        shifted=None if found.approximate or common else _shift(surfaces, start, place, scale),
    )


def expansion(job: EvaluatedJob) -> float:
    """Return the expansion of the part, 1/K; that of steel if unknown."""
    known = job.options.climate.part.expansion
    if known is not None:
        return known.per_k
    material = job.plan.material
    return STEEL_PER_K if material is None else 1e-6 * material.expansion_ppm


def ball_taken_off(job: EvaluatedJob, common: Common) -> Float:
    """Return the shift of ball centres, (N, 3), mm, world, that undoes a larger ball."""
    moved = np.zeros((len(job.points), 3))
    back = common.place.T_nominal_from_world.rotation
    for surface in common.surfaces:
        _, normals, _ = surface.lies(common.place.T_nominal_from_world)
        moved[surface.places] = -(common.ball or 0.0) * normals @ back
    return moved


def growth_taken_off(job: EvaluatedJob, common: Common) -> Float:
    """Return the shift of ball centres, (N, 3), mm, world, that undoes the part's growth."""
    moved = np.zeros((len(job.points), 3))
    back = common.place.T_nominal_from_world.rotation
    for surface in common.surfaces:
        _, normals, _ = surface.lies(common.place.T_nominal_from_world)
        contacts = surface.tips - surface.tip_radius * normals @ back
        moved[surface.places] = -(common.growth or 0.0) * contacts
    return moved


def brought_home(job: EvaluatedJob, common: Common, name: str) -> Float:
    """Return the shift (N, 3), mm, of ball centres onto a nominal placed by other features."""
    others = [surface for surface in common.surfaces if surface.name != name]
    T = common.place.T_nominal_from_world
    if len(others) > 1:
        T = rigid(others, T).T_nominal_from_world
    moved = np.zeros((len(job.points), 3))
    for surface in common.surfaces:
        if surface.name == name:
            off, normals, _ = surface.lies(T)
            moved[surface.places] = -(off[:, None] * normals) @ T.rotation
    return moved


def scatter_of(job: EvaluatedJob, leave_out: Collection[str]) -> float | None:
    """Return the scatter of nearly all features relative to their noise.

    None if it is normal, or shown by too few features: the form of one surface is its own. Spots
    that scatter more than stated need no further witness.
    """
    excess = [item.ratio for item in job.noise.cameras if item.exceeds]
    if excess:
        return max(excess)
    samples = [item for item in job.samples if item.feature not in leave_out]
    ratios = [scatter_ratio(item) for item in samples]
    weights = [item.degrees for item in samples]
    if len(samples) < 3:
        return None
    noisy = sum(ratio > 0.5 * _NOISY for ratio in ratios)
    mean = float(np.average(ratios, weights=weights))
    return None if mean < _NOISY or noisy < 0.7 * len(samples) else float(np.sqrt(mean))


def scatter_ratio(sample: FormSample) -> float:
    """Return the mean square of a feature's residuals relative to noise alone."""
    return max(sample.scatter, _NOTHING) / max(sample.scatter - sample.variance, _NOTHING)


def _explains(plain: CommonPattern, pattern: CommonPattern) -> bool:
    """Return whether a pattern improves several features, and worsens none of weight."""
    scale = min(plain.scale(), pattern.scale())
    before, after = plain.unexplained(scale), pattern.unexplained(scale)
    if abs(pattern.amount) < _SURE * pattern.sigma or after > _REMAINS * before:
        return False
    nearer = {name: off - pattern.misfits[name] for name, off in plain.misfits.items()}
    won = sum(gain > _GAIN * max(plain.misfits[name], scale) for name, gain in nearer.items())
    lost = sum(-gain > _GAIN * max(pattern.misfits[name], scale) for name, gain in nearer.items())
    return won >= _LEAST_WITNESSES and won >= _MANY * lost


def _is_ball(
    plain: CommonPattern, ball: CommonPattern, surfaces: Collection[TouchedSurface]
) -> bool:
    """Return whether sizes support the ball: inner and outer ones, or enough of one kind."""
    agree = [
        item for item in _sized(surfaces)
        if ball.misfits[item.name] < _FOLLOWS * ball.scale()
        and ball.misfits[item.name] < plain.misfits[item.name]
    ]  # fmt: skip
    sides = {_is_inner(item) for item in agree}
    return len(agree) >= (_LEAST_WITNESSES if len(sides) > 1 else _LEAST_SIZES)


def _sized(surfaces: Collection[TouchedSurface]) -> list[TouchedSurface]:
    return [item for item in surfaces if item.nominal.shape.spec.is_curved]


def _is_inner(surface: TouchedSurface) -> bool:
    return surface.nominal.side == "inner"


def _shift(
    surfaces: tuple[TouchedSurface, ...],
    planned: RigidTransform,
    place: CommonPattern,
    scale: float,
) -> float | None:
    """Return the error of the plan's frame at the features, mm; None if none."""
    there = misfits_in(surfaces, planned)
    won = sum(
        there[name] > _STRAYS * scale and off < _FOLLOWS * scale
        for name, off in place.misfits.items()
    )
    if won < _LEAST_WITNESSES:
        return None
    places = np.array([surface.geometry[:3] for surface in surfaces])
    world = planned.inverse().apply(places)
    apart = np.linalg.norm(place.T_nominal_from_world.apply(world) - places, axis=1)
    return float(np.median(apart))
