"""Toleranced characteristics of a plan.

Recommended numbers of points for form: BS 7172, NPL guide 41.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import msgspec

from ocmm_core.part_model import NominalFace

if TYPE_CHECKING:
    # Loads what computes; the Start page reads the words of this file.
    from ocmm_core.features.measured import ActualFeature

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
    kind: str
    """One of `kinds.KINDS`; see docs/quality/characteristics.md."""
    features: list[str]
    upper: float
    nominal: float = 0.0
    lower: float = 0.0
    """`nominal`, `lower`, `upper`: mm or deg; a geometrical tolerance t has only ``upper`` = t."""
    limits: Literal["set", "proposed"] = "set"
    """``"proposed"``: the program chose the limits; not valid until a person sets them."""
    axis: Literal["", "x", "y", "z"] = ""
    """In the part frame: of a coordinate or distance; across a zone of two planes."""
    datums: list[str] = msgspec.field(default_factory=list)
    """Datum features in order of precedence."""
    association: Association = ""
    """Association of size or form with the points; empty is the feature's own criterion for sizes,
    minimum zone for form (ISO 1101). Letters of ISO 14405-1: GG least squares, GC minimum zone, GX
    inscribed, GN circumscribed, LP two-point. A distance of two opposite faces with it is a
    two-point size."""
    zone: Literal["", "planes", "cylinder", "sphere"] = ""
    """Of position, orientation; "": planes for a face, sphere for a point, else cylinder."""
    modifier: Literal["", "maximum material", "least material"] = ""
    """Widens the tolerance of a position by the departure of the size from its material limit."""
    material_size: float = 0.0
    """mm: limit of maximum or least material, see ``modifier``."""
    length: float = 0.0
    """mm: toleranced length of an axis; zero: the probed length."""
    offset: float = 0.0
    """mm: offset of a profile's zone from the nominal surface (UZ); negative into the material."""
    at: float = 0.0
    """mm: distance from the datum plane, along its normal, of the diameter of a cone."""
    faces: tuple[NominalFace, ...] = ()
    """Faces that ball centres are compared with; default: the nominal surface of each feature."""


def points_note(features: Sequence[ActualFeature], *, of_form: bool) -> str:
    """Return a note on too few points, or nothing.

    Form from fewer points than recommended misses most of it; other quantities then do not reveal
    form at all. With ``of_form`` the measurand is the form of the surface.
    """
    few = [
        feature
        for feature in features
        if feature.touches is not None
        and len(feature.numbers) < feature.fit.shape.spec.recommended_points
    ]
    if not few:
        return ""
    gaps = [
        f"{feature.nominal.name} has {len(feature.numbers)} of "
        f"{feature.fit.shape.spec.recommended_points} recommended"
        for feature in few
    ]
    # One sentence each: lists would be ambiguous in other languages.
    if of_form:
        return " ".join(f"Few points: {gap}." for gap in gaps)
    return " ".join(f"Form not evaluated: {gap}." for gap in gaps)
