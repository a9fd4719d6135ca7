"""Geometrical tolerances with zone, modifiers and datums in their order (ISO 10303-47)."""

from __future__ import annotations

import msgspec

from ocmm_cad.pmi._dimensions import Aspects
from ocmm_cad.pmi._items import DatumReference, Tolerance
from ocmm_cad.pmi._measures import EXTRAS, TOLERANCES, ZONES, check_entity, measure_of
from ocmm_cad.pmi._part21 import Argument, BadEntityError, Part21, Ref, Typed, Word, plain, refs

_ALL = (*TOLERANCES, "GEOMETRIC_TOLERANCE", "MODIFIED_GEOMETRIC_TOLERANCE")
LARGEST_MM = 1000.0


class Tolerances:
    """Read geometrical tolerances; faults are stored in the item."""

    def __init__(self, file: Part21, aspects: Aspects, labels: dict[int, str]) -> None:
        self._file, self._aspects, self._labels = file, aspects, labels
        self._zones: dict[int, list[int]] = {}
        for word in ("TOLERANCE_ZONE", *(w for w in ZONES if "TOLERANCE_ZONE" in w)):
            for tolerance, zones in file.users(word, 4).items():
                self._zones.setdefault(tolerance, []).extend(zones)
        self._defined: dict[int, list[str]] = {}
        for word, said in ZONES.items():
            for zone in file.users(word, 0):
                self._defined.setdefault(zone, []).append(said)
        self._segments, self._related = self._composites()

    def all(self) -> tuple[Tolerance, ...]:
        return tuple(self._tolerance(number) for number in self._file.all_of(*_ALL))

    def _composites(self) -> tuple[dict[int, str], dict[int, str]]:
        word = "GEOMETRIC_TOLERANCE_RELATIONSHIP"
        segments: dict[int, str] = {}
        related: dict[int, str] = {}
        for number in self._file.all_of(word):
            try:
                name = plain(self._file.argument(number, 0, word)) or "without a name"
                upper, lower = (self._file.reference(number, place, word) for place in (2, 3))
            except BadEntityError:
                # The related tolerances cannot read it either.
                continue
            if name != "composite":
                related.update({upper: name, lower: name})
                continue
            segments.setdefault(upper, "upper")
            segments[lower] = "lower"
        return segments, related

    def _tolerance(self, number: int) -> Tolerance:
        item = Tolerance(
            entity=number, name=self._labels.get(number, f"tolerance #{number}"), word="tolerance",
            segment=self._segments.get(number, ""),
        )  # fmt: skip
        try:
            types = self._file.types(number)
            kinds = sorted(types & set(TOLERANCES))
            if len(kinds) != 1:
                named = [word for word in sorted(types) if word.endswith("_TOLERANCE")]
                raise BadEntityError(
                    f"its kind {' '.join(named).lower().replace('_', ' ')} is unknown"
                )
            check_entity(self._file, number, "tolerance")
            word = kinds[0].removesuffix("_TOLERANCE").replace("_", " ").lower()
            own = ("GEOMETRIC_TOLERANCE", kinds[0])
            name = self._labels.get(number) or plain(self._file.argument(number, 0, *own))
            item = msgspec.structs.replace(item, word=word, name=name or item.name)
            item = self._with_zone(item, types)
            item = self._with_datums(item, types, kinds[0])
            faces = self._aspects.faces(self._file.reference(number, 3, *own))
            odd = (*faces.others, *(["a derived aspect"] if faces.derived else []))
            item = msgspec.structs.replace(item, faces=faces.numbers, odd=odd)
            size = measure_of(self._file, self._file.reference(number, 2, *own))
            if size.of != "length" or not 0.0 <= size.value <= LARGEST_MM:
                raise BadEntityError(f"its size {size.value:g} is no width of a zone")
            return msgspec.structs.replace(item, size=size.value)
        except BadEntityError as error:
            return msgspec.structs.replace(item, fault=str(error))

    def _with_zone(self, item: Tolerance, types: frozenset[str]) -> Tolerance:
        extras = [said for word, said in EXTRAS.items() if word in types]
        related = self._related.get(item.entity)
        if related:
            extras.append(f"related to another one ('{related}')")
        forms = []
        for zone in self._zones.get(item.entity, []):
            check_entity(self._file, zone, "zone")
            extras += self._defined.get(zone, [])
            extras += [said for word, said in ZONES.items() if word in self._file.types(zone)]
            words = ("TOLERANCE_ZONE", *ZONES)
            form = self._file.reference(zone, 5, *words)
            check_entity(self._file, form, "zone form")
            forms.append(plain(self._file.argument(form, 0, "TOLERANCE_ZONE_FORM")))
        if len(set(forms)) > 1:
            raise BadEntityError("the file gives it several forms of its zone")
        modifiers: tuple[str, ...] = ()
        if "GEOMETRIC_TOLERANCE_WITH_MODIFIERS" in types:
            held = self._file.argument(item.entity, 0, "GEOMETRIC_TOLERANCE_WITH_MODIFIERS")
            modifiers = tuple(_modifier(one) for one in (held if isinstance(held, tuple) else ()))
        return msgspec.structs.replace(
            item, zone=forms[0] if forms else "", modifiers=modifiers,
            extras=tuple(dict.fromkeys(extras)),
        )  # fmt: skip

    def _with_datums(self, item: Tolerance, types: frozenset[str], kind: str) -> Tolerance:
        if "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE" in types:
            held = refs(
                self._file.argument(item.entity, 0, "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
            )
        elif "GEOMETRIC_TOLERANCE" in types:
            held = []
        else:
            arguments = self._file.arguments(item.entity, kind)
            held = refs(arguments[4]) if len(arguments) > 4 else []
        if not held:
            return item
        systems = [number for number in held if "DATUM_SYSTEM" in self._file.types(number)]
        if systems and len(held) > 1:
            raise BadEntityError(f"the file gives it {len(held)} datum systems")
        if systems:
            check_entity(self._file, systems[0], "datum system")
            parts = refs(self._file.argument(systems[0], 4, "DATUM_SYSTEM"))
            datums = [self._compartment(part) for part in parts]
        else:
            datums = self._in_order(held)
        return msgspec.structs.replace(item, datums=tuple(datums))

    def _compartment(self, number: int) -> DatumReference:
        check_entity(self._file, number, "datum reference")
        words = ("DATUM_REFERENCE_COMPARTMENT", "DATUM_REFERENCE_ELEMENT")
        base = self._file.argument(number, 4, *words)
        held = self._file.argument(number, 5, *words)
        modifiers = tuple(_modifier(one) for one in held) if isinstance(held, tuple) else ()
        labels: list[str] = []
        for part in refs(base):
            types = self._file.types(part)
            if "DATUM" in types:
                labels.append(_letter(self._file, part))
            elif "DATUM_REFERENCE_ELEMENT" in types:
                below = self._compartment(part)
                labels += below.labels
                modifiers += below.modifiers
            else:
                raise BadEntityError(f"its datum #{part} is of an unknown type")
        if not labels:
            raise BadEntityError(f"its datum reference #{number} names no datum")
        return DatumReference(labels=tuple(labels), modifiers=modifiers)

    def _in_order(self, held: list[int]) -> list[DatumReference]:
        """Return datum references of older schemas, with numeric precedence."""
        found: dict[int, DatumReference] = {}
        for number in held:
            check_entity(self._file, number, "older datum reference")
            place = self._file.argument(number, 0, "DATUM_REFERENCE")
            letter = _letter(self._file, self._file.reference(number, 1, "DATUM_REFERENCE"))
            if not isinstance(place, int) or place in found:
                raise BadEntityError("the order of its datums is not clear")
            found[place] = DatumReference(labels=(letter,))
        return [found[place] for place in sorted(found)]


def _letter(file: Part21, datum: int) -> str:
    check_entity(file, datum, "datum")
    letter = plain(file.argument(datum, 4, "DATUM"), 20)
    if not letter:
        raise BadEntityError(f"its datum #{datum} has no letter")
    return letter


def _modifier(argument: Argument) -> str:
    match argument:
        case Word(word):
            return word.replace("_", " ").lower()
        case Typed(_, values) if len(values) == 1:
            return _modifier(values[0])
        case Ref(number):
            return f"modifier #{number} with a value"
    return "a modifier that cannot be read"
