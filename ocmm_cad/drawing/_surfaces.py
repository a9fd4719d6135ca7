"""Features of a plan by faces of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ocmm_cad.drawing._account import RefusedError
from ocmm_cad.step import StepModel
from ocmm_core.features.shapes import NominalFeature, Shape


@dataclass(frozen=True, slots=True)
class Found:
    features: tuple[NominalFeature, ...]
    """Each once, in the order of the faces."""
    missing: tuple[str, ...]
    """Why faces are no features: parts of a sentence, each once."""
    part_of: tuple[str, ...]
    """Features of which only some faces were named."""


class Surfaces:
    """Features of a plan by their faces, without omitted ones."""

    def __init__(self, model: StepModel, features: Mapping[str, NominalFeature]) -> None:
        self._model, self._features = model, features
        self._why = {one.feature.name: one.why for one in model.left_out}
        self._faces: dict[str, set[int]] = {}
        for number, names in model.faces.items():
            for name in names:
                self._faces.setdefault(name, set()).add(number)

    def of(self, faces: Sequence[int]) -> Found:
        found: dict[str, NominalFeature] = {}
        missing: dict[str, int] = {}
        for number in faces:
            name, why = self._name(number)
            if why:
                missing[why] = missing.get(why, 0) + 1
            else:
                found[name] = self._features[name]
        said = tuple(f"{why} ({n} faces)" if n > 1 else why for why, n in missing.items())
        whole = set(faces)
        part_of = tuple(name for name in found if not self._faces[name] <= whole)
        return Found(tuple(found.values()), said, part_of)

    def one(self, faces: Sequence[int], odd: Sequence[str]) -> NominalFeature:
        """Return the one feature of some faces; RefusedError if none, several, or other items."""
        found = self.all_of(faces, odd)
        if found.missing:
            raise RefusedError(found.missing[0])
        if len(found.features) != 1:
            names = ", ".join(feature.name for feature in found.features)
            raise RefusedError(f"it is between more than two surfaces: {names}")
        return found.features[0]

    def all_of(self, faces: Sequence[int], odd: Sequence[str]) -> Found:
        """Return the features of faces; RefusedError if none, or if edges are included."""
        if odd:
            words = ", ".join(word.lower().replace("_", " ") for word in odd)
            raise RefusedError(f"it is attached to something that is not probed ({words})")
        if not faces:
            raise RefusedError("the file names no faces for it")
        found = self.of(faces)
        if not found.features:
            raise RefusedError("; ".join(found.missing))
        return found

    def _name(self, number: int) -> tuple[str, str]:
        names = self._model.faces.get(number, ())
        if len(names) > 1:
            return "", f"its part stands {len(names)} times in the assembly"
        if not names:
            word = self._model.face_words.get(number, "")
            known = word in {shape.value for shape in Shape}
            if known or not word:
                return "", "its face is no part of a solid, or was not found by the reader"
            return "", f"its surface is of the kind {word}"
        if names[0] not in self._features:
            return "", self._why.get(names[0], "its surface is not among the features of the plan")
        return names[0], ""
