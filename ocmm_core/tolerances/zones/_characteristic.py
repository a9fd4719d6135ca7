"""What a plan says about one toleranced quantity."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.part_model import NominalFace

Association = Literal[
    "",
    "least squares",
    "minimum zone",
    "inscribed",
    "circumscribed",
    "two-point maximum",
    "two-point minimum",
    "two-point mean",
]

TWO_POINT: tuple[Association, ...] = ("two-point maximum", "two-point minimum", "two-point mean")
"""Associations of local sizes between opposite points, by rank."""


class Characteristic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One toleranced quantity."""

    name: str
    """Unique in the plan."""
    kind: str
    """One of `kinds.KINDS`; docs/characteristics.md says what each is."""
    features: list[str]
    """Names of the features, probed or constructed."""
    upper: float
    nominal: float = 0.0
    lower: float = 0.0
    """`nominal`, `lower`, `upper`: Nominal value and the limits of the deviation from it, mm, or
    deg for an angle. A geometrical tolerance t has ``upper`` = t alone."""
    axis: Literal["", "x", "y", "z"] = ""
    """Of the aligned part frame: what a coordinate is; along which a distance is taken; the
    direction across the planes of a zone of two planes, for points and axes."""
    datums: list[str] = msgspec.field(default_factory=list)
    """Names of the datum features in their order of precedence."""
    association: Association = ""
    """How size or form is associated with the points; empty is the feature's own criterion for
    sizes, minimum zone for form (ISO 1101), and the letters of ISO 14405-1 are GG least squares, GC
    minimum zone, GX inscribed, GN circumscribed, LP two-point. A distance of two opposite faces is
    a two-point size with it."""
    zone: Literal["", "planes", "cylinder", "sphere"] = ""
    """Of position and of the orientation of an axis; empty is what is usual for the feature: two
    planes for a face, a sphere for a point or ball, a cylinder for all else."""
    modifier: Literal["", "maximum material", "least material"] = ""
    """Widens the tolerance of a position by what the size is off its limit of material."""
    material_size: float = 0.0
    """mm: that limit, of maximum or least material, as the modifier says."""
    length: float = 0.0
    """mm: toleranced length of an axis; zero takes the length that was probed."""
    offset: float = 0.0
    """mm: how far the zone of a profile lies outside the nominal surface (UZ), material at the
    inside; negative inwards."""
    at: float = 0.0
    """mm: distance from the datum plane, along its normal, at which the diameter of a cone is
    taken."""
    faces: tuple[NominalFace, ...] = ()
    """Of the model, for the profile of a surface: what every ball centre is held against. Without
    them it is the nominal surface of each feature."""
    limits: Literal["set", "proposed"] = "set"
    """``"proposed"``: the program chose the limits; not valid until a person sets them."""
