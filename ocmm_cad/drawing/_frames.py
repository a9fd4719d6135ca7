"""Import of datums as features of the plan, and of one datum system as its alignment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import zip_longest

import msgspec
import numpy as np

from ocmm_cad.drawing._context import AccountItem, Context, RefusedError
from ocmm_cad.pmi import Datum, DatumReference, DatumTarget, Tolerance
from ocmm_core.alignment import DatumReferenceFrame, datum_frame
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import Bisector, nominal_geometries
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import add_construction, add_feature, with_alignment
from ocmm_core.names import name_fault

_OPPOSITE = -1.0 + 1e-9
_SAME_PLANE_MM = 1e-3
_LEAST_EACH = 3
_TARGETS = (
    "datum targets are not supported; add a feature that is touched at them, and the tolerances "
    "that name it, by hand"
)
_SAFE_WITHOUT = ("maximum material requirement", "least material requirement")
"""They let the part move within the datum: what conforms without them conforms with them."""
_MOST = 100
"""Points on each face of a datum of several, and targets of it."""


class DatumFrames:
    """Datums of a model; two opposite faces give a middle plane in the plan."""

    def __init__(
        self, context: Context, datums: Sequence[Datum], targets: Sequence[DatumTarget]
    ) -> None:
        self._context = context
        self._names: dict[str, str] = {}
        self._why: dict[str, str] = {}
        self._items: list[AccountItem] = []
        self._targets = targets
        for datum in datums:
            self._items.append(self._import_datum(datum))

    def account(self) -> list[AccountItem]:
        found = [
            AccountItem(
                group="datum target", name=one.name, kind=f"{one.word} of datum {one.datum}",
                entity=one.entity, status="refused",
                why=one.fault or _TARGETS,
            )
            for one in self._targets
        ]  # fmt: skip
        return [*self._items, *found]

    def names_of(self, references: Sequence[DatumReference]) -> list[str]:
        """Return the features named by datum references, in order.

        RefusedError for a modifier, a common datum, or one that is no feature of the plan.
        """
        names = []
        for reference in references:
            label = "-".join(reference.labels)
            if reference.modifiers:
                words = ", ".join(reference.modifiers)
                safe = all(word in _SAFE_WITHOUT for word in reference.modifiers)
                raise RefusedError(
                    f"datum {label} has the modifier '{words}', which is not supported; add the "
                    + ("tolerance by hand without it, which is on the safe side" if safe
                       else "tolerance by hand as the drawing means it")
                )  # fmt: skip
            if len(reference.labels) != 1:
                raise RefusedError(
                    f"{label} is a common datum, which is not supported; construct its axis or "
                    "plane, and add the tolerance by hand"
                )
            if label not in self._names:
                why = self._why.get(label, "the file does not say what it is")
                raise RefusedError(f"datum {label} is not available: {why}")
            names.append(self._names[label])
        if len(set(names)) < len(names):
            raise RefusedError("two of its datums are one feature")
        return names

    def open_motions(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return motions left open, in words; RefusedError if even the drawn part is not held."""
        plan = self._context.plan
        nominals = nominal_geometries(plan.features, plan.constructions)
        try:
            return datum_frame(names, nominals, plan.shapes, nominals).free.names()
        except FitError as error:
            raise RefusedError(f"its datums do not hold: {error.what}") from error

    def align(self, tolerances: Sequence[Tolerance]) -> str:
        """Align the plan to the datum system of most tolerances; return a sentence about it.

        Only a system without open motions, and only if the plan has no alignment.
        """
        if self._context.plan.alignment is not None:
            return "The plan keeps its alignment; tolerances name their datums themselves."
        uses: Counter[tuple[str, ...]] = Counter()
        for item in tolerances:
            try:
                names = self.names_of(item.datums)
                if names and not item.fault and not self.open_motions(names):
                    uses[tuple(names)] += 1
            except RefusedError:
                continue
        if not uses:
            return (
                "No datum system of the model holds the part by itself: the plan has no alignment."
            )
        datums, count = uses.most_common(1)[0]
        rule = DatumReferenceFrame(datums=datums)
        try:
            self._context.changed(with_alignment(self._context.plan, rule))
        except InputError as error:
            return f"The plan has no alignment: {error.what}"
        letters = {name: letter for letter, name in self._names.items()}
        system = "|".join(letters[name] for name in datums)
        return (
            f"Alignment: datum system {system} ({', '.join(datums)}), named by {count} tolerances. "
            "Other datum systems stand with their tolerances."
        )

    def _import_datum(self, datum: Datum) -> AccountItem:
        said = AccountItem(
            group="datum", name=datum.name, kind="datum", entity=datum.entity, status="refused"
        )
        try:
            name = self._feature(datum)
        except RefusedError as error:
            self._why[datum.name] = str(error)
            return msgspec.structs.replace(said, why=str(error))
        self._names[datum.name] = name
        return msgspec.structs.replace(said, status="taken", became=(name,))

    def _feature(self, datum: Datum) -> str:
        if datum.fault:
            raise RefusedError(datum.fault)
        if datum.targets:
            raise RefusedError(
                "it is made of datum targets, which are not supported; add a feature that is "
                "touched at them, and the tolerances that name it, by hand"
            )
        found = self._context.surfaces.all_of(datum.faces, datum.odd)
        if found.missing:
            raise RefusedError(found.missing[0])
        features = found.features
        if len(features) == 1:
            return features[0].name
        if len(features) == 2 and _face_away(*features):
            return self._middle(datum.name, features)
        if _are_one_plane(features):
            return self._whole_plane(datum.name, features)
        names = ", ".join(feature.name for feature in features[:4])
        more = ", …" if len(features) > 4 else ""
        raise RefusedError(f"it is made of {len(features)} surfaces ({names}{more}), not supported")

    def _whole_plane(self, letter: str, features: tuple[NominalFeature, ...]) -> str:
        """Add one plane for several coplanar faces, touched in turn, to the plan; return it."""
        name = self._free(letter)
        rows = zip_longest(*(feature.targets for feature in features))
        targets = tuple(place for row in rows for place in row if place is not None)
        points = max(features[0].points, min(len(targets), _LEAST_EACH * len(features)))
        whole = msgspec.structs.replace(
            features[0], name=name, targets=targets[:_MOST], points=points, length=0.0, width=0.0,
            text=f"Datum {letter}: {len(features)} faces in one plane",
        )  # fmt: skip
        try:
            self._context.changed(add_feature(self._context.plan, whole))
        except InputError as error:
            raise RefusedError(f"its faces cannot be one plane: {error.what}") from error
        return name

    def _free(self, letter: str) -> str:
        name = f"DATUM_{letter}"
        if name in self._context.plan.shapes or name_fault(name):
            raise RefusedError(f"the plan has a feature {name} already, or it is no name")
        return name

    def _middle(self, letter: str, features: tuple[NominalFeature, ...]) -> str:
        plan = self._context.plan
        name = self._free(letter)
        middle = Bisector(name=name, features=tuple(feature.name for feature in features))
        try:
            self._context.changed(add_construction(plan, middle))
        except InputError as error:
            raise RefusedError(f"its middle plane cannot be made: {error.what}") from error
        return name


def _are_one_plane(features: Sequence[NominalFeature]) -> bool:
    if any(one.shape is not Shape.PLANE or not one.targets for one in features):
        return False
    first = np.array(features[0].direction)
    arms = np.array([one.point for one in features]) - features[0].point
    alike = all(float(first @ one.direction) > -_OPPOSITE for one in features)
    return alike and bool(np.abs(arms @ first).max() < _SAME_PLANE_MM)


def _face_away(first: NominalFeature, second: NominalFeature) -> bool:
    if first.shape is not Shape.PLANE or second.shape is not Shape.PLANE:
        return False
    return float(np.dot(first.direction, second.direction)) < _OPPOSITE
