"""Datums, their features, and the targets that they are touched at."""

from __future__ import annotations

import msgspec

from ocmm_core.inspection.pmi._aspects import Aspects
from ocmm_core.inspection.pmi._items import Datum, DatumTarget
from ocmm_core.inspection.pmi._part21 import BadEntityError, Part21, plain

_TARGETS = ("PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")


class Datums:
    """Reads datums; what is wrong with one is said in it."""

    def __init__(self, file: Part21, aspects: Aspects, labels: dict[int, str]) -> None:
        self._file, self._aspects, self._labels = file, aspects, labels
        self._features = file.users("SHAPE_ASPECT_RELATIONSHIP", 3)
        self._feet = file.users("FEATURE_FOR_DATUM_TARGET_RELATIONSHIP", 3)

    def targets(self) -> tuple[DatumTarget, ...]:
        """Return the datum targets of the file in its order."""
        return tuple(self._target(number) for number in self._file.all_of(*_TARGETS))

    def all(self) -> tuple[Datum, ...]:
        """Return the datums of the file in its order."""
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
            letter = plain(self._file.argument(number, 4, "DATUM"), 20)
            if not letter:
                msg = "it has no letter"
                raise BadEntityError(msg)
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
        own = self._aspects.faces(item.entity).numbers
        if own and faces and set(own) != set(faces):
            msg = "the file names other faces for the datum than for its feature"
            raise BadEntityError(msg)
        return msgspec.structs.replace(
            item, labels=tuple(labels), targets=tuple(targets), odd=tuple(odd),
            faces=tuple(sorted(faces or own)),
        )  # fmt: skip


def letters_twice(datums: tuple[Datum, ...]) -> tuple[Datum, ...]:
    """Return datums, those with a fault of which another one has the letter."""
    names = [one.name for one in datums]
    return tuple(
        msgspec.structs.replace(one, fault=one.fault or "the file has its letter twice")
        if names.count(one.name) > 1
        else one
        for one in datums
    )
