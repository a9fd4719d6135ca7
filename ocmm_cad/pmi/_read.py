"""Reader of all tolerances in a STEP text: faces, datum features and targets, labels, notes.

Selected entities and units are also read without reading all of the file. The geometry library
assumes millimetres and radians without units, or with a factor that contradicts its name. Here such
a file is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from ocmm_cad.pmi._dimensions import DIMENSIONS, Aspects, Dimensions
from ocmm_cad.pmi._items import Annotation, Datum, DatumTarget, Pmi
from ocmm_cad.pmi._measures import TOLERANCES, check_entity, unit_of
from ocmm_cad.pmi._part21 import BadEntityError, Part21, plain, read_part21, refs
from ocmm_cad.pmi._tolerances import Tolerances

_LINKS = ("DRAUGHTING_MODEL_ITEM_ASSOCIATION", "DRAUGHTING_MODEL_ITEM_ASSOCIATION_WITH_PLACEHOLDER")
_SAYS = "PMI representation to presentation link"
_HOLDS = "PROPERTY_DEFINITION_REPRESENTATION"
_STANDARD = re.compile(r"ASME Y14\.5(?:\.1)?M?(?:-\d{4})?|ISO (?:1101|8015|5459|2768)\b(?::\d{4})?")
_ITEMS = ("DIMENSION", "ANGULAR_SIZE", "ANGULAR_LOCATION", "DATUM", "PLACED_DATUM")
_LONGEST = 300


class Labels:
    """Callouts of a file and their items."""

    def __init__(self, file: Part21) -> None:
        self._file = file
        self._texts = file.users(_HOLDS, 0)
        self._about: dict[int, list[int]] = {}
        self._said: dict[int, list[int]] = {}
        for word in _LINKS:
            for number in file.all_of(word):
                try:
                    definition = file.reference(number, 2, word)
                    is_link = plain(file.argument(number, 0, word)) == _SAYS
                    shown = refs(file.argument(number, 4, word))
                except BadEntityError:
                    continue
                for callout in shown:
                    self._about.setdefault(callout, []).append(definition)
                    if is_link:
                        self._said.setdefault(callout, []).append(definition)
        self.names = self._names()

    def _names(self) -> dict[int, str]:
        found: dict[int, str] = {}
        for callout in self._about:
            name = self._name(callout)
            for number in self._shown(callout):
                if name:
                    found.setdefault(number, name)
        return found

    def annotations(self, aspects: Aspects, of_items: frozenset[int]) -> tuple[Annotation, ...]:
        """Return all callouts in file order; `of_items`: dimensions, tolerances, datum targets."""
        found = []
        for number in self._file.all_of("DRAUGHTING_CALLOUT", "LEADER_DIRECTED_CALLOUT"):
            item = Annotation(entity=number, name=self._name(number) or f"annotation #{number}")
            about = self._about.get(number, [])
            try:
                shows = self._shown(number)
                on = [one for one in about if self._is_aspect(one)]
                item = msgspec.structs.replace(
                    item, shows=shows, own_aspect=any(one not in of_items for one in on)
                )
                if not shows:
                    faces = {
                        face for one in on for face in aspects.faces(one, is_note=True).numbers
                    }
                    item = msgspec.structs.replace(
                        item, text=self._text(about), faces=tuple(sorted(faces))
                    )
            except BadEntityError as error:
                item = msgspec.structs.replace(item, fault=str(error))
            found.append(item)
        return tuple(found)

    def _shown(self, callout: int) -> tuple[int, ...]:
        """Return the items of a callout; an explicit link wins over that at the leader's end."""
        about = self._said.get(callout) or self._about.get(callout, [])
        return tuple(dict.fromkeys(one for one in about if self._is_item(one)))

    def standards(self) -> tuple[str, ...]:
        """Return the tolerancing standards named in texts of the file."""
        found: dict[str, None] = {}
        for number in self._file.all_of("DESCRIPTIVE_REPRESENTATION_ITEM", "PRODUCT", "DOCUMENT"):
            found |= dict.fromkeys(_STANDARD.findall(self._file.bodies[number]))
        return tuple(found)

    def _name(self, number: int) -> str:
        try:
            return plain(self._file.argument(number, 0, "DRAUGHTING_CALLOUT"), 60)
        except BadEntityError:
            return ""

    def _types(self, number: int) -> frozenset[str]:
        try:
            return self._file.types(number)
        except BadEntityError:
            return frozenset()

    def _is_item(self, number: int) -> bool:
        types = self._types(number)
        return any(word.startswith(_ITEMS) or "_TOLERANCE" in word for word in types)

    def _is_aspect(self, number: int) -> bool:
        types = self._types(number)
        return any("SHAPE_ASPECT" in word or word == "PRODUCT_DEFINITION_SHAPE" for word in types)

    def _text(self, about: list[int]) -> str:
        for definition in about:
            if "PROPERTY_DEFINITION" not in self._types(definition):
                continue
            for held in self._file.users("PROPERTY_DEFINITION_REPRESENTATION", 0).get(
                definition, []
            ):
                shown = self._file.reference(held, 1, "PROPERTY_DEFINITION_REPRESENTATION")
                for item in refs(self._file.argument(shown, 1, "REPRESENTATION")):
                    if "DESCRIPTIVE_REPRESENTATION_ITEM" in self._types(item):
                        said = self._file.argument(item, 1, "DESCRIPTIVE_REPRESENTATION_ITEM")
                        return plain(said, _LONGEST)
        return ""


_TARGETS = ("PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")


class Datums:
    """Read datums; faults are stored in the item."""

    def __init__(self, file: Part21, aspects: Aspects, labels: dict[int, str]) -> None:
        self._file, self._aspects, self._labels = file, aspects, labels
        self._features = file.users("SHAPE_ASPECT_RELATIONSHIP", 3)
        self._feet = file.users("FEATURE_FOR_DATUM_TARGET_RELATIONSHIP", 3)

    def targets(self) -> tuple[DatumTarget, ...]:
        return tuple(self._target(number) for number in self._file.all_of(*_TARGETS))

    def all(self) -> tuple[Datum, ...]:
        return tuple(self._datum(number) for number in self._file.all_of("DATUM"))

    def _target(self, number: int) -> DatumTarget:
        item = DatumTarget(
            entity=number, name=self._labels.get(number, f"datum target #{number}"),
            word="datum target", datum="",
        )  # fmt: skip
        try:
            of = [one for one in self._aspects.related(number) if "DATUM" in self._file.types(one)]
            letter = plain(self._file.argument(of[0], 4, "DATUM"), 20) if of else ""
            which = plain(self._file.argument(number, 4, *_TARGETS), 20)
            item = msgspec.structs.replace(
                item, datum=letter, word=plain(self._file.argument(number, 1, *_TARGETS)),
                name=self._labels.get(number) or f"{letter}{which}",
            )  # fmt: skip
            faces: list[int] = []
            for relation in self._feet.get(number, []):
                word = "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"
                faces += self._aspects.faces(self._file.reference(relation, 2, word)).numbers
            return msgspec.structs.replace(item, faces=tuple(faces))
        except BadEntityError as error:
            return msgspec.structs.replace(item, fault=str(error))

    def _datum(self, number: int) -> Datum:
        item = Datum(entity=number, name=f"datum #{number}")
        try:
            check_entity(self._file, number, "datum")
            letter = plain(self._file.argument(number, 4, "DATUM"), 20)
            if not letter:
                raise BadEntityError("it has no letter")
            item = msgspec.structs.replace(item, name=letter)
            word = "SHAPE_ASPECT_RELATIONSHIP"
            givers = [
                self._file.reference(relation, 2, word)
                for relation in self._features.get(number, [])
            ]
            return self._with_features(item, givers)
        except BadEntityError as error:
            return msgspec.structs.replace(item, fault=str(error))

    def _with_features(self, item: Datum, givers: list[int]) -> Datum:
        labels: list[str] = []
        targets: list[str] = []
        faces: dict[int, None] = {}
        odd: dict[str, None] = {}
        for giver in givers:
            types = self._file.types(giver)
            if types & set(_TARGETS):
                targets.append(self._labels.get(giver, f"#{giver}"))
            elif "DATUM_FEATURE" in types:
                found = self._aspects.faces(giver)
                labels.append(self._labels.get(giver, f"#{giver}"))
                faces |= dict.fromkeys(found.numbers)
                odd |= dict.fromkeys(found.others)
                if found.derived:
                    odd["a derived aspect"] = None
            else:
                raise BadEntityError(f"its feature #{giver} is no datum feature")
        own = self._aspects.faces(item.entity).numbers
        if own and faces and set(own) != set(faces):
            raise BadEntityError("the file names other faces for the datum than for its feature")
        return msgspec.structs.replace(
            item, labels=tuple(labels), targets=tuple(targets), odd=tuple(odd),
            faces=tuple(sorted(faces or own)),
        )  # fmt: skip


def letters_twice(datums: tuple[Datum, ...]) -> tuple[Datum, ...]:
    """Return datums, with a fault for duplicate letters."""
    names = [one.name for one in datums]
    return tuple(
        msgspec.structs.replace(one, fault=one.fault or "the file has its letter twice")
        if names.count(one.name) > 1
        else one
        for one in datums
    )


_SURFACES = {
    "PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere", "TOROIDAL_SURFACE": "Torus",
}  # fmt: skip
_MOST_ITEMS = 20_000


@dataclass(frozen=True, slots=True)
class FaceText:
    number: int
    shape: str
    """Word of its surface, as of a `Shape` if it can be probed."""
    radius: float = 0.0
    """Of cylinders and spheres, in the unit of the file; else 0."""


def may_say_tolerances(text: str) -> bool:
    """Return whether a text has words of tolerances: most large files, read slowly, have none."""
    return any(word in text for word in (*DIMENSIONS, "DATUM", "CALLOUT", "_TOLERANCE"))


def read_pmi(text: str) -> tuple[Pmi, tuple[FaceText, ...]]:
    """Return the tolerances of a file and its faces, in order; faults are in the items."""
    try:
        file = read_part21(text)
    except BadEntityError as error:
        return Pmi(fault=str(error)), ()
    faces = tuple(_face(file, number) for number in file.all_of("ADVANCED_FACE", "FACE_SURFACE"))
    count = sum(
        len(file.by_type.get(word, ())) for word in (*DIMENSIONS, "DATUM", "DRAUGHTING_CALLOUT")
    )
    count += sum(len(file.by_type.get(word, ())) for word in TOLERANCES)
    if count > _MOST_ITEMS:
        return Pmi(fault=f"the file has {count} dimensions, tolerances and notes"), faces
    labels = Labels(file)
    aspects = Aspects(file)
    datums = Datums(file, aspects, labels.names)
    pmi = Pmi(
        dimensions=Dimensions(file, aspects, labels.names).all(),
        tolerances=Tolerances(file, aspects, labels.names).all(),
        datums=letters_twice(datums.all()),
        targets=datums.targets(),
        annotations=labels.annotations(aspects, _aspects_of_items(file)),
        standards=labels.standards(),
    )
    return pmi, faces


def _face(file: Part21, number: int) -> FaceText:
    try:
        words = ("ADVANCED_FACE", "FACE_SURFACE")
        surface = refs(file.arguments(number, *words)[2])[0]
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
    found: set[int] = set()
    words = (*DIMENSIONS, *TOLERANCES, "GEOMETRIC_TOLERANCE")
    for number in file.all_of(*words, "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"):
        try:
            for arguments in file.records(number).values():
                found |= set(refs(arguments))
        except BadEntityError:
            continue
    return frozenset(found)


_UNITS, _CONTEXT = "GLOBAL_UNIT_ASSIGNED_CONTEXT", "GEOMETRIC_REPRESENTATION_CONTEXT"


def picked_entities(content: bytes, words: Sequence[str]) -> Part21:
    """Return the entities whose text has any of some words; BadEntityError as `read_part21`.

    A semicolon inside a text may truncate an entity: then the whole file is read.
    """
    wanted = re.compile("|".join(map(re.escape, words)).encode(), re.IGNORECASE)
    begin = content.find(b"DATA")
    picked: list[bytes] = [b"DATA"]
    end = max(begin, 0)
    while found := wanted.search(content, end):
        start = max(content.rfind(b";", 0, found.start()) + 1, 0)
        end = content.find(b";", found.end())
        end = len(content) if end < 0 else end
        picked.append(content[start:end])
    text = b";\n".join((*picked, b"")).decode("utf-8", errors="replace")
    if any(one.count(b"'") % 2 or b"/*" in one for one in picked):
        text = content.decode("utf-8", errors="replace")
    return read_part21(text)


def units_fault(content: bytes) -> str:
    """Return the fault of a model's units, as a part of a sentence; empty if none."""
    try:
        file = picked_entities(content, ("UNIT", _CONTEXT))
        if not file.all_of(_UNITS):
            return "it names no units of length and angle"
        for number in file.all_of(_CONTEXT):
            records = file.records(number)
            flat = records[_CONTEXT] and records[_CONTEXT][-1] != 3
            if "PARAMETRIC_REPRESENTATION_CONTEXT" in records or flat:
                continue
            kinds = [
                unit_of(file, one).dimension
                for one in refs(records.get(_UNITS, ()))
                if file.types(one) & {"LENGTH_UNIT", "PLANE_ANGLE_UNIT"}
            ]
            for of in ("length", "angle"):
                if kinds.count(of) != 1:
                    count = "no unit" if of not in kinds else "several units"
                    return f"its geometry has {count} of {of} (#{number})"
    except BadEntityError as error:
        return str(error)
    return ""
