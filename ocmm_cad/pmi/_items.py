"""Tolerance items of a model: numbers, words and faces."""

from __future__ import annotations

import msgspec


class _Item(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    entity: int
    """Number in the file."""
    name: str
    """Label in the model."""
    fault: str = ""
    """Why it cannot be trusted, as a part of a sentence; empty if it can."""


class Dimension(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    word: str
    """Type in the word of the file: ``diameter``, ``linear distance``."""
    is_location: bool
    """Between two aspects, else of one."""
    of: str = ""
    """``length``: mm, or ``angle``: deg; empty without a value."""
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    """`lower`, `upper`: Signed deviations from the nominal; None without a tolerance."""
    fit: str = ""
    """Code of limits and fits, such as ``H7``."""
    notes: tuple[str, ...] = ()
    """``theoretical``, ``auxiliary`` and other words that change its meaning."""
    faces: tuple[int, ...] = ()
    other_faces: tuple[int, ...] = ()
    """`faces`, `other_faces`: Numbers of the faces of the (first and) second aspect."""
    odd: tuple[str, ...] = ()
    """Other members, such as edges."""


class DatumReference(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A datum in the precedence of a tolerance."""

    labels: tuple[str, ...]
    """One, or those of a common datum (A-B)."""
    modifiers: tuple[str, ...] = ()


class Tolerance(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    word: str
    """Type of the file without ``_TOLERANCE``: ``position``, ``surface profile``."""
    size: float | None = None
    """mm; None if unreadable."""
    zone: str = ""
    """Form of the zone in the words of the file; may be empty."""
    modifiers: tuple[str, ...] = ()
    """In the words of the file."""
    extras: tuple[str, ...] = ()
    """Additions that change its meaning: projected zone, area, unequal zone."""
    datums: tuple[DatumReference, ...] = ()
    segment: str = ""
    """``upper`` or ``lower`` of a composite tolerance."""
    faces: tuple[int, ...] = ()
    odd: tuple[str, ...] = ()
    """`faces`, `odd`: As of `Dimension`."""


class DatumTarget(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A target of a datum: where it is touched."""

    word: str
    datum: str
    faces: tuple[int, ...] = ()


class Datum(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A datum: its name is its letter."""

    labels: tuple[str, ...] = ()
    faces: tuple[int, ...] = ()
    odd: tuple[str, ...] = ()
    """`faces`, `odd`: As of `Dimension`; of all its datum features."""
    targets: tuple[str, ...] = ()
    """Labels of its targets."""


class Annotation(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A note or the picture of an item."""

    shows: tuple[int, ...] = ()
    """Numbers of the items that it depicts; empty for a note."""
    text: str = ""
    faces: tuple[int, ...] = ()
    """`text`, `faces`: Of a note: text, and annotated faces."""
    own_aspect: bool = False
    """Its leader ends at an aspect without dimension or tolerance."""


class Pmi(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All tolerance items of a file."""

    dimensions: tuple[Dimension, ...] = ()
    tolerances: tuple[Tolerance, ...] = ()
    datums: tuple[Datum, ...] = ()
    targets: tuple[DatumTarget, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    standards: tuple[str, ...] = ()
    """Tolerancing standards named in the file."""
    fault: str = ""
    """Why nothing can be used; part of a sentence."""

    @property
    def is_empty(self) -> bool:
        return not (
            self.dimensions or self.tolerances or self.datums or self.targets or self.annotations
        )
