"""What a model says of its tolerances, as it is passed on: numbers, words and faces."""

from __future__ import annotations

import msgspec


class _Item(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What all items share."""

    entity: int
    """Number in the file."""
    name: str
    """Label that the model gives it."""
    fault: str = ""
    """Why it cannot be believed, as a part of a sentence; empty where nothing is wrong."""


class Dimension(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A size, distance or angle."""

    word: str
    """What it is, in the word of the file: ``diameter``, ``linear distance``."""
    is_location: bool
    """It is between two aspects, else of one."""
    of: str = ""
    """``length``: mm, or ``angle``: deg; empty where the file has no value."""
    nominal: float | None = None
    """None where the file has none."""
    lower: float | None = None
    upper: float | None = None
    """`lower`, `upper`: Deviations from the nominal, with their sign; None where there is no
    tolerance."""
    fit: str = ""
    """Code of limits and fits, such as ``H7``."""
    notes: tuple[str, ...] = ()
    """``theoretical``, ``auxiliary`` and other words that change what it means."""
    faces: tuple[int, ...] = ()
    other_faces: tuple[int, ...] = ()
    """`faces`, `other_faces`: Numbers of the faces of the (first and) second aspect."""
    odd: tuple[str, ...] = ()
    """What else it stands for, such as edges."""


class DatumReference(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A datum in the precedence of a tolerance."""

    labels: tuple[str, ...]
    """One, or those of a common datum (A-B)."""
    modifiers: tuple[str, ...] = ()


class Tolerance(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A geometrical tolerance."""

    word: str
    """Type of the file without ``_TOLERANCE``: ``position``, ``surface profile``."""
    size: float | None = None
    """mm; None where it could not be read."""
    zone: str = ""
    """Form of the zone in the words of the file; empty where it says none."""
    modifiers: tuple[str, ...] = ()
    """Of the tolerance, in the words of the file."""
    extras: tuple[str, ...] = ()
    """What else belongs to it and changes its meaning: projected zone, area, unequal zone."""
    datums: tuple[DatumReference, ...] = ()
    """In their order."""
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
    """Numbers of the items that it is the picture of; empty for a note."""
    text: str = ""
    faces: tuple[int, ...] = ()
    """`text`, `faces`: Of a note: what it says, and the faces that it stands on."""
    own_aspect: bool = False
    """Its leader ends at an aspect that no dimension or tolerance has."""


class Pmi(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All that a file says of tolerances."""

    dimensions: tuple[Dimension, ...] = ()
    tolerances: tuple[Tolerance, ...] = ()
    datums: tuple[Datum, ...] = ()
    targets: tuple[DatumTarget, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    standards: tuple[str, ...] = ()
    """Standards of tolerancing that it names."""
    fault: str = ""
    """Why nothing of it can be used; part of a sentence."""

    @property
    def is_empty(self) -> bool:
        """Return whether the file says nothing of tolerances."""
        return not (
            self.dimensions or self.tolerances or self.datums or self.targets or self.annotations
        )
