"""A measured point: the record of one touch, and the reason of a refused one."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float

PATH = "path"
"""Value of `MeasuredPoint.approach` of points along a path."""
FASTEST_MM_S = 100.0


@dataclass(frozen=True, slots=True)
class MeasuredPoint:
    """One accepted touch."""

    number: int
    """1, 2, 3 ... in the order of the job; never used twice."""
    feature: str
    time_s: float
    """Bus time of the middle of the window, s."""
    first_frame: int
    last_frame: int
    n_frames: int
    """`first_frame`, `last_frame`, `n_frames`: window by exposure counter, and frames used."""
    tip_world: Float
    """(3,), mm: averaged ball centre."""
    random_covariance: Float
    """(3, 3), mm^2: of the average, from the scatter of the window, with correlated frames, and
    from ball motion indistinguishable from noise (`tracking.stillness`). Excludes calibration
    errors, which are common to many points and propagated from ``spots`` (`_factors`)."""
    direction: Float
    """(3,), unit, world: from the material towards the probe."""
    tip_radius: float
    """mm."""
    rotation_world_from_probe: Float
    """(3, 3): mean attitude in the window."""
    spots: Float
    """(C, L, 2), px: mean spots by LED number, NaN if not seen throughout the window."""
    chi2_per_dof: float
    """Mean over the window."""
    approach: str
    """Method of ``direction``: ``"trail"``, ``"pulled"``, ``"shank"``, ``"nominal"`` or
    ``"flipped"``."""
    reference_spots: Float | None = None
    """(C, R, 2), px: mean spots of the reference body in the same frames; None without one. With
    one, "world" is the world of the job (`tracking.reference`)."""

    @property
    def surface_world(self) -> Float:
        """Return the compensated surface point (3,), mm, world frame."""
        return self.tip_world - self.tip_radius * self.direction

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Return which camera saw which LED, (C, L)."""
        return np.asarray(np.isfinite(self.spots).all(axis=2))


class RefusalCode(Enum):
    """Reason of a refused touch."""

    LOST = "lost"
    UNIDENTIFIED = "unidentified"
    DOUBTFUL = "doubtful"
    MOVING = "moving"
    GAP = "gap"
    NOT_READY = "not_ready"
    CALIBRATION = "calibration"
    REFERENCE = "reference"
    TIP = "tip"
    UNCERTAIN = "uncertain"
    OUTSIDE = "outside"
    NO_FEATURE = "no_feature"
    NO_APPROACH = "no_approach"
    WRONG_FACE = "wrong_face"
    AMBIGUOUS = "ambiguous"
    PAUSED = "paused"
    STORAGE = "storage"


@dataclass(frozen=True, slots=True)
class Refusal:
    """A refused touch: the reason and the remedy, in words for the inspector."""

    code: RefusalCode
    what: str
    remedy: str
    time_s: float


@dataclass(frozen=True, slots=True)
class PathProgress:
    """The path so far, for display."""

    length_mm: float
    speed_mm_s: float
    covered: float | None = None
    """Share of the planned scan; None without one."""
    lifted: bool = False
    """Whether the ball seems to be off the surface."""

    @property
    def fast(self) -> bool:
        """Return whether the ball is too fast for points along the path."""
        return self.speed_mm_s > FASTEST_MM_S
