"""What a model says of its tolerances, as it is passed on: numbers, words and faces."""

from __future__ import annotations

import msgspec


class _Item(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What all items share.

    Attributes
    ----------
    entity
        Number in the file.
    name
        Label that the model gives it.
    fault
        Why it cannot be believed, as a part of a sentence; empty where nothing is wrong.
    """

    entity: int
    name: str
    fault: str = ""


class Dimension(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A size, distance or angle.

    Attributes
    ----------
    word
        What it is, in the word of the file: ``diameter``, ``linear distance``.
    is_location
        It is between two aspects, else of one.
    of
        ``length``: mm, or ``angle``: deg; empty where the file has no value.
    nominal
        None where the file has none.
    lower, upper
        Deviations from the nominal, with their sign; None where there is no tolerance.
    fit
        Code of limits and fits, such as ``H7``.
    notes
        ``theoretical``, ``auxiliary`` and other words that change what it means.
    faces, other_faces
        Numbers of the faces of the (first and) second aspect.
    odd
        What else it stands for, such as edges.
    """

    word: str
    is_location: bool
    of: str = ""
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    fit: str = ""
    notes: tuple[str, ...] = ()
    faces: tuple[int, ...] = ()
    other_faces: tuple[int, ...] = ()
    odd: tuple[str, ...] = ()


class DatumReference(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A datum in the precedence of a tolerance.

    Attributes
    ----------
    labels
        One, or those of a common datum (A-B).
    modifiers
        In the words of the file.
    """

    labels: tuple[str, ...]
    modifiers: tuple[str, ...] = ()


class Tolerance(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A geometrical tolerance.

    Attributes
    ----------
    word
        Type of the file without ``_TOLERANCE``: ``position``, ``surface profile``.
    size
        mm; None where it could not be read.
    zone
        Form of the zone in the words of the file; empty where it says none.
    modifiers
        Of the tolerance, in the words of the file.
    extras
        What else belongs to it and changes its meaning: projected zone, area, unequal zone.
    datums
        In their order.
    segment
        ``upper`` or ``lower`` of a composite tolerance.
    faces, odd
        As of `Dimension`.
    """

    word: str
    size: float | None = None
    zone: str = ""
    modifiers: tuple[str, ...] = ()
    extras: tuple[str, ...] = ()
    datums: tuple[DatumReference, ...] = ()
    segment: str = ""
    faces: tuple[int, ...] = ()
    odd: tuple[str, ...] = ()


class DatumTarget(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A target of a datum: where it is touched."""

    word: str
    datum: str
    faces: tuple[int, ...] = ()


class Datum(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A datum: its name is its letter.

    Attributes
    ----------
    labels
        Of its datum features.
    faces, odd
        As of `Dimension`; of all its datum features.
    targets
        Labels of its targets.
    """

    labels: tuple[str, ...] = ()
    faces: tuple[int, ...] = ()
    odd: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()


class Annotation(_Item, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A note or the picture of an item.

    Attributes
    ----------
    shows
        Numbers of the items that it is the picture of; empty for a note.
    text, faces
        Of a note: what it says, and the faces that it stands on.
    own_aspect
        Its leader ends at an aspect that no dimension or tolerance has.
    """

    shows: tuple[int, ...] = ()
    text: str = ""
    faces: tuple[int, ...] = ()
    own_aspect: bool = False


class Pmi(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All that a file says of tolerances.

    Attributes
    ----------
    standards
        Standards of tolerancing that it names.
    fault
        Why nothing of it can be used; part of a sentence.
    """

    dimensions: tuple[Dimension, ...] = ()
    tolerances: tuple[Tolerance, ...] = ()
    datums: tuple[Datum, ...] = ()
    targets: tuple[DatumTarget, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    standards: tuple[str, ...] = ()
    fault: str = ""

    @property
    def is_empty(self) -> bool:
        """Return whether the file says nothing of tolerances."""
        return not (
            self.dimensions or self.tolerances or self.datums or self.targets or self.annotations
        )

    @property
    def labels(self) -> tuple[int, int, int]:
        """Return how many dimensions, tolerances and datums OpenCascade's reader has labels for.

        It has one more dimension for each note and each label whose leader ends at an aspect of its
        own, no tolerance without a shape, and one datum for each reference of a tolerance, of a
        datum with targets each of them. So both readings can be compared.
        """
        more = sum(one.own_aspect or not one.shows for one in self.annotations)
        shown = [one for one in self.tolerances if one.faces or one.odd]
        targets = {one.name: max(1, len(one.targets)) for one in self.datums}
        references = sum(
            targets.get(reference.labels[0], 1) if len(reference.labels) == 1
            else len(reference.labels)
            for one in shown
            for reference in one.datums
        )  # fmt: skip
        return len(self.dimensions) + more, len(shown), references
