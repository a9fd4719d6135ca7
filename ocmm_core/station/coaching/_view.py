"""Input and output of the coach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.coach import Ellipsoid, Hint, ProbePicture, Sensitivities
from ocmm_core.geometry import Float

_ALIKE = 0.1
"""mm: smaller differences of the ellipsoid are invisible."""
_ALIKE_RAD = float(np.radians(6.0))


@dataclass(frozen=True, slots=True, eq=False)
class LastPose:
    rotation: Float
    tip_rig: Float
    """`rotation`, `tip_rig`: (3, 3) and (3,), mm, frame of the rig."""
    spots: Float
    """(C, L, 2), px, of that frame."""
    sensitivities: Sensitivities


@dataclass(frozen=True, slots=True, eq=False)
class ProbeNow:
    """The last state of the probe."""

    good: bool
    lost: bool
    """Without pose, because too few LEDs are seen or they are ambiguous."""
    named: bool
    """LEDs are identified."""
    seen: NDArray[np.bool_]
    """(C, L): which camera sees which LED now."""
    last: LastPose | None
    """Of the last good frame; None before the first."""


@dataclass(frozen=True, slots=True, eq=False)
class CoachView:
    """Display next to the readout."""

    ellipsoid: Ellipsoid | None = None
    hint: Hint | None = None
    """A turn that would improve it; None if not worthwhile."""
    remedy: str = ""
    """Remedy while the probe is lost; else empty."""
    picture: ProbePicture | None = None
    """Of the probe; None before its first search."""

    def looks_like(self, other: CoachView) -> bool:
        """Return whether two views are indistinguishable on the screen."""
        return (
            self.hint == other.hint
            and self.remedy == other.remedy
            and _same_ellipsoid(self.ellipsoid, other.ellipsoid)
            and _same_picture(self.picture, other.picture)
        )


NOTHING = CoachView()


def _same_ellipsoid(one: Ellipsoid | None, other: Ellipsoid | None) -> bool:
    if one is None or other is None:
        return one is other
    if not np.allclose(one.half_axes_mm, other.half_axes_mm, rtol=_ALIKE):
        return False
    if not np.allclose(one.outline_mm[:2], other.outline_mm[:2], rtol=_ALIKE):
        return False
    # An ellipse looks the same after half a turn, and a circle always.
    turned = abs(float(np.sin(one.outline_mm[2] - other.outline_mm[2])))
    round_enough = one.outline_mm[1] > (1.0 - _ALIKE) * one.outline_mm[0]
    return bool(round_enough or turned < np.sin(_ALIKE_RAD))


def _same_picture(one: ProbePicture | None, other: ProbePicture | None) -> bool:
    if one is None or other is None:
        return one is other
    reach = float(np.linalg.norm(one.leds, axis=1).max())
    return (
        one.turn == other.turn
        and one.known is other.known
        and np.array_equal(one.seen, other.seen)
        and float(np.abs(one.leds - other.leds).max()) < _ALIKE_RAD * reach
    )
