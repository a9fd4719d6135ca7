"""All that the text of a STEP file says of tolerances, and what its faces are."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.inspection.pmi._aspects import Aspects
from ocmm_core.inspection.pmi._datums import Datums, letters_twice
from ocmm_core.inspection.pmi._dimensions import DIMENSIONS, Dimensions
from ocmm_core.inspection.pmi._items import Pmi
from ocmm_core.inspection.pmi._labels import Labels
from ocmm_core.inspection.pmi._part21 import BadEntityError, Part21, read_part21, refs
from ocmm_core.inspection.pmi._tolerances import KINDS, Tolerances

_SURFACES = {
    "PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere", "TOROIDAL_SURFACE": "Torus",
}  # fmt: skip
_MOST_ITEMS = 20_000


@dataclass(frozen=True, slots=True)
class FaceText:
    """A face as the text has it."""

    number: int
    """In the file."""
    shape: str
    """Word of its surface, as of a `Shape` where it is one of those that can be probed."""
    radius: float = 0.0
    """Of cylinders and spheres, in the unit of the file; else 0."""


def may_say_tolerances(text: str) -> bool:
    """Return whether a text has a word of those without which it says nothing of tolerances.

    To read all entities of a large file takes seconds; most large files say nothing.
    """
    return any(word in text for word in (*DIMENSIONS, "DATUM", "CALLOUT", "_TOLERANCE"))


def read_pmi(text: str) -> tuple[Pmi, tuple[FaceText, ...]]:
    """Return what a file says of tolerances, and its faces in the order of the file.

    What is wrong with one item is said in it; nothing is raised for what a file says.

    Parameters
    ----------
    text
        The whole file.
    """
    try:
        file = read_part21(text)
    except BadEntityError as error:
        return Pmi(fault=str(error)), ()
    faces = tuple(_face(file, number) for number in file.all_of("ADVANCED_FACE", "FACE_SURFACE"))
    count = sum(
        len(file.by_type.get(word, ())) for word in (*DIMENSIONS, "DATUM", "DRAUGHTING_CALLOUT")
    )
    count += sum(len(file.by_type.get(f"{kind}_TOLERANCE", ())) for kind in KINDS)
    if count > _MOST_ITEMS:
        return Pmi(fault=f"the file has {count} dimensions, tolerances and notes"), faces
    labels = Labels(file)
    aspects = Aspects(file)
    datums = Datums(file, aspects, labels.names)
    dimensions = Dimensions(file, aspects, labels.names).all()
    tolerances = Tolerances(file, aspects, labels.names).all()
    pmi = Pmi(
        dimensions=dimensions,
        tolerances=tolerances,
        datums=letters_twice(datums.all()),
        targets=datums.targets(),
        annotations=labels.annotations(aspects, _aspects_of_items(file)),
        standards=labels.standards(),
    )
    return pmi, faces


def _face(file: Part21, number: int) -> FaceText:
    try:
        words = ("ADVANCED_FACE", "FACE_SURFACE")
        arguments = file.arguments(number, *words)
        surface = refs(arguments[2])[0]
        records = file.records(surface)
    except (BadEntityError, IndexError):
        return FaceText(number, "unreadable")
    for word, shape in _SURFACES.items():
        if word in records:
            radius = records[word][-1] if shape in ("Cylinder", "Sphere") else 0.0
            return FaceText(
                number, shape, float(radius) if isinstance(radius, float | int) else 0.0
            )
    return FaceText(number, sorted(records)[0].lower().replace("_", " "))


def _aspects_of_items(file: Part21) -> frozenset[int]:
    """Return the aspects that dimensions, tolerances and datum targets name."""
    found: set[int] = set()
    words = (*DIMENSIONS, *(f"{kind}_TOLERANCE" for kind in KINDS), "GEOMETRIC_TOLERANCE")
    for number in file.all_of(*words, "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"):
        try:
            for arguments in file.records(number).values():
                found |= set(refs(arguments))
        except BadEntityError:
            continue
    return frozenset(found)
