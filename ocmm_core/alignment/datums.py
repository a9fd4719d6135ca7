"""The part frame from measured datum features."""

from __future__ import annotations

import msgspec


class DatumAlignment(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The part frame from measured features (3-2-1).

    Attributes
    ----------
    primary
        Plane whose normal is the z axis of the part frame.
    secondary
        Two features with centres: x points from the first to the second, along the plane.
    origin
        Feature whose centre, dropped on the primary plane, is the origin.
    """

    primary: str
    secondary: tuple[str, str]
    origin: str
