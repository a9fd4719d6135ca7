"""View control: keep the work in view with minimal motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target
from ocmm_core.rendering import choose_side
from ocmm_gui.scene import Orbit

_MARGIN = 1.18
_CHASE = 1.4
"""Extra room after the ball left the view: a view that moves along is illegible."""
_CALM = 1.45
"""A view wider than necessary by this factor zooms in."""
_LATER = 8
_RIM = 0.03
"""Relative edge zone that is about to be left."""


def _none() -> Float:
    return np.empty((0, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """Contents to be shown; places are (n, 3), mm, world."""

    ball: Float = field(default_factory=_none)
    target: Target | None = None
    active: Float = field(default_factory=_none)
    whole: Float = field(default_factory=_none)
    """The part, as far as known."""

    def needed(self) -> Float:
        """Return what must stay in view."""
        target = _none() if self.target is None else self.target.surface_world[None]
        return np.concatenate([self.ball, target, self.active])

    def all(self) -> Float:
        """Return everything that the view should show."""
        return np.concatenate([self.needed(), self.whole])


def side_for(
    orbit: Orbit, target: Target, later: Sequence[Target], is_hidden: Callable[[Float], bool]
) -> Orbit:
    """Return the view turned to make the next place visible; the same object if it is.

    `is_hidden`: Whether the part is between the next place and an eye in a direction (3,).
    """
    toward = orbit.axes()[2]
    normals = np.array([one.normal_world for one in later[:_LATER]]).reshape(-1, 3)
    side = choose_side(toward, target.normal_world, orbit.up, is_hidden, normals)
    return orbit if side is toward else orbit.looking_from(side)


def following(orbit: Orbit, work: Work, width: float, height: float, *, turned: bool) -> Orbit:
    """Return a view that shows the work; the same if sufficient and not just `turned`."""
    everything = work.all()
    if not len(everything):
        return orbit
    wanted = orbit.fitted(everything, width, height, _MARGIN)
    if turned:
        return wanted
    if not in_picture(orbit, work.needed(), width, height, _RIM):
        left = len(work.ball) and not in_picture(orbit, work.ball, width, height, _RIM)
        return orbit.fitted(everything, width, height, _CHASE) if left else wanted
    calm = orbit.radius <= _CALM * wanted.radius
    return orbit if calm and in_picture(orbit, work.whole, width, height, 0.0) else wanted


def in_picture(orbit: Orbit, places: Float, width: float, height: float, rim: float) -> bool:
    """Return whether places (n, 3) are in view with a relative margin ``rim``."""
    seen = orbit.project(places, width, height)[:, :2] / np.array([width, height])
    return bool(((seen >= rim) & (seen <= 1.0 - rim)).all())
