"""What a plan says about one toleranced quantity."""

from __future__ import annotations

from typing import Literal

import msgspec


class Characteristic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One toleranced quantity.

    Attributes
    ----------
    name
        Unique in the plan.
    kind
        ``"diameter"`` of one feature; ``"distance"`` of two (point or centre to plane along the
        normal, plane to plane at the first one's centroid, otherwise centre to centre);
        ``"coordinate"`` of one feature in the aligned part frame; ``"form"`` of one feature.
    features
        Names of the features.
    axis
        For coordinates: ``"x"``, ``"y"`` or ``"z"``.
    nominal, lower, upper
        Nominal value and the limits of the deviation from it, mm.
    """

    name: str
    kind: Literal["diameter", "distance", "coordinate", "form"]
    features: list[str]
    nominal: float
    lower: float
    upper: float
    axis: Literal["", "x", "y", "z"] = ""
