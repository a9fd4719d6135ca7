"""What a relocation is asked for, with the defaults that commands show before loading it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

World = Literal["cameras", "points", "set"]
"""Reference of the world frame: cameras, known control points, or three new ones."""

LensMode = Literal["fixed", "prior", "free"]
"""Treatment of the lenses: kept (their uncertainty stays in the covariance), free with their
previous covariance as prior, or determined from these frames alone."""

GeometryMode = Literal["known", "uncertain", "unknown"]
"""Knowledge of the probe's LEDs: exact; with the uncertainty of the probe body; none, so that the
bar alone gives the scale."""


@dataclass(frozen=True, slots=True)
class RelocationRequest:
    world: World = "cameras"
    lens: LensMode = "prior"
    geometry: GeometryMode = "uncertain"
    poses: int = 300
    placements: int = 10
    """`poses`, `placements`: least number of the probe and of the bar."""
    limit: float = 0.005
    """Standard uncertainty of a length to reach, mm."""
    seats: bool = True
    """Two seats are visited first and last; False only for recordings without, which the result
    reports."""
