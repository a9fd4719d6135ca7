"""The labels that a model shows, what each is the picture of, and the text of its notes."""

from __future__ import annotations

import re

import msgspec

from ocmm_core.inspection.pmi._aspects import Aspects
from ocmm_core.inspection.pmi._items import Annotation
from ocmm_core.inspection.pmi._part21 import BadEntityError, Part21, plain, refs

_LINKS = ("DRAUGHTING_MODEL_ITEM_ASSOCIATION", "DRAUGHTING_MODEL_ITEM_ASSOCIATION_WITH_PLACEHOLDER")
_SAYS = "PMI representation to presentation link"
_HOLDS = "PROPERTY_DEFINITION_REPRESENTATION"
_STANDARD = re.compile(r"ASME Y14\.5(?:\.1)?M?(?:-\d{4})?|ISO (?:1101|8015|5459|2768)\b(?::\d{4})?")
_ITEMS = ("DIMENSION", "ANGULAR_SIZE", "ANGULAR_LOCATION", "DATUM", "PLACED_DATUM")
_LONGEST = 300


class Labels:
    """What the callouts of a file are about."""

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
        """Return the labels of items by their number."""
        found: dict[int, str] = {}
        for callout in self._about:
            name = self._name(callout)
            for number in self._shown(callout):
                if name:
                    found.setdefault(number, name)
        return found

    def annotations(self, aspects: Aspects, of_items: frozenset[int]) -> tuple[Annotation, ...]:
        """Return all callouts in the order of the file.

        Parameters
        ----------
        of_items
            Numbers of the aspects that dimensions, tolerances and datum targets have.
        """
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
                    faces = {face for one in on for face in aspects.faces(one).numbers}
                    item = msgspec.structs.replace(
                        item, text=self._text(about), faces=tuple(sorted(faces))
                    )
            except BadEntityError as error:
                item = msgspec.structs.replace(item, fault=str(error))
            found.append(item)
        return tuple(found)

    def _shown(self, callout: int) -> tuple[int, ...]:
        """Return the items that a callout is the picture of.

        A file that says so has another link to the aspect that the leader ends at, which may be
        that of a datum; then only the first one counts.
        """
        about = self._said.get(callout) or self._about.get(callout, [])
        return tuple(dict.fromkeys(one for one in about if self._is_item(one)))

    def standards(self) -> tuple[str, ...]:
        """Return the standards of tolerancing that texts of the file name."""
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
        """Return whether an entity is a dimension, tolerance, datum feature or target."""
        types = self._types(number)
        return any(word.startswith(_ITEMS) or "_TOLERANCE" in word for word in types)

    def _is_aspect(self, number: int) -> bool:
        types = self._types(number)
        return any("SHAPE_ASPECT" in word or word == "PRODUCT_DEFINITION_SHAPE" for word in types)

    def _text(self, about: list[int]) -> str:
        """Return the text of a note, where the file has it as text."""
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
