"""The list of what is in a plan, and proposals for what is added to it."""

from __future__ import annotations

import msgspec
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from ocmm_core.features.nominal import NominalFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.plan_edit import usual_points
from ocmm_core.tolerances.characteristic import Characteristic, Kind
from ocmm_gui.theme import text_font

HEAD = ""
"""Stands for the plan as a whole among its items."""

_NAME = Qt.ItemDataRole.UserRole
_ROW_PX = 34
_ROUND = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)


class PlanItems(QListWidget):
    """The plan itself, its features, its constructions and its characteristics."""

    item_chosen = Signal(str)
    """Emits the name of the item that was chosen, or `HEAD`."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Items of the plan")
        self.setAccessibleDescription("Up and down choose an item")
        self.setFont(text_font(15))
        self.currentRowChanged.connect(self._on_row)

    def show_plan(self, plan: Plan, chosen: str) -> None:
        """Show the items of a plan; ``chosen`` is chosen if it is among them."""
        self.blockSignals(True)
        self.clear()
        self._add(f"Plan {plan.name}", HEAD)
        for feature in plan.features:
            count = "point" if feature.points == 1 else "points"
            self._add(
                f"{feature.name}   {feature.shape.value}, {feature.points} {count}", feature.name
            )
        for construction in plan.constructions:
            # It is written in the document; here it is seen, and can be moved and removed.
            self._add(f"= {construction.name}", construction.name, editable=False)
        for item in plan.characteristics:
            self._add(f"±  {item.name}   {item.kind}", item.name)
        names = [self.item(row).data(_NAME) for row in range(self.count())]
        self.setCurrentRow(names.index(chosen) if chosen in names else 0)
        self.blockSignals(False)

    def chosen(self) -> str:
        """Return the name of the chosen item, or `HEAD`."""
        row = self.currentRow()
        return str(self.item(row).data(_NAME)) if row >= 0 else HEAD

    def group(self, plan: Plan) -> int:
        """Return which form shows the chosen item: 0 plan, 1 feature, 2 characteristic."""
        name = self.chosen()
        if name in {feature.name for feature in plan.features}:
            return 1
        return 2 if name in {item.name for item in plan.characteristics} else 0

    def named(self, plan: Plan, name: str) -> NominalFeature | Characteristic:
        """Return the feature or characteristic of a name; KeyError if there is none."""
        both: tuple[NominalFeature | Characteristic, ...] = (
            *plan.features, *plan.characteristics,
        )  # fmt: skip
        for item in both:
            if item.name == name:
                return item
        raise KeyError(name)

    def place_after(self, plan: Plan, name: str) -> int:
        """Return the place in its list that comes after an item; the end for any other."""
        for group in (plan.features, plan.constructions, plan.characteristics):
            names = [item.name for item in group]
            if name in names:
                return names.index(name) + 1
        return len(plan.features)

    def _add(self, text: str, name: str, *, editable: bool = True) -> None:
        item = QListWidgetItem(text, self)
        item.setData(_NAME, name)
        item.setSizeHint(QSize(180, _ROW_PX))
        item.setToolTip(text if editable else f"{text}: write it in the document of the plan")
        if not editable:
            item.setFlags(Qt.ItemFlag.NoItemFlags)

    def _on_row(self, row: int) -> None:
        if row >= 0:
            self.item_chosen.emit(str(self.item(row).data(_NAME)))


def new_feature(plan: Plan, chosen: str) -> NominalFeature:
    """Return a feature like the chosen one, or a plane, under a name that is free."""
    for feature in plan.features:
        if feature.name == chosen:
            return msgspec.structs.replace(
                feature, name=_free_name(plan, feature.name), text="", picture=""
            )
    return NominalFeature(
        name=_free_name(plan, "FEATURE"),
        shape=Shape.PLANE,
        points=usual_points(Shape.PLANE),
        point=(0.0, 0.0, 0.0),
    )


def new_characteristic(plan: Plan, chosen: str) -> Characteristic | None:
    """Return the usual characteristic of the chosen feature; None where none is chosen."""
    for feature in plan.features:
        if feature.name == chosen:
            kind: Kind = "form"
            nominal, lower, upper = 0.0, 0.0, 0.1
            if feature.shape in _ROUND:
                kind, nominal, lower = "diameter", feature.diameter, -0.1
            return Characteristic(
                name=_free_name(plan, f"{feature.name} {kind}"),
                kind=kind,
                features=[feature.name],
                nominal=nominal,
                lower=lower,
                upper=upper,
            )
    return None


def _free_name(plan: Plan, name: str) -> str:
    taken = {
        item.name for item in (*plan.features, *plan.constructions, *plan.characteristics)
    }
    if name not in taken:
        return name
    stem = name.rstrip("0123456789")
    numbered = (f"{stem}{number}" for number in range(2, len(taken) + 3))
    return next(free for free in numbered if free not in taken)
