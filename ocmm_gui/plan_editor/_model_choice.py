"""Selection of a model's surfaces as features, next to its picture."""

from __future__ import annotations

from PySide6.QtCore import Signal

from ocmm_cad.step import Offer
from ocmm_core.typed_numbers import ZONE
from ocmm_gui.kit import (
    ChoiceBox,
    caption,
    form_field,
    millimetres,
    said,
    shape_word,
    split_unit,
    to_mm,
    tr,
    typed_value,
    unit_word,
)
from ocmm_gui.plan_editor._importing import ReadModel
from ocmm_gui.plan_editor._part_choice import ChoiceLine, ChoiceWords, PartChoice

UPS = ("+z", "-z", "+y", "-y", "+x", "-x")


class ModelChoice(PartChoice):
    """All surfaces offered by a model; emits the selected `Offer`s, a tuple."""

    up_changed = Signal(str)
    """Emits the upward axis of the model, which changes reachability."""

    def __init__(self) -> None:
        self._read: ReadModel | None = None
        self._offers: tuple[Offer, ...] = ()
        words = tr("Profile of free forms, {unit}").format(unit=unit_word())
        self.zone = form_field(words, tr("Width of the zone"))
        super().__init__(
            ChoiceWords(
                choice=tr("Features of the model"),
                list=tr("Surfaces of the model"),
                take=tr("Take over  [Return]"),
                take_long=tr("Take the chosen surfaces over as features"),
                back_long=tr("Go back without features"),
                about=tr("Why the selected surface is not chosen"),
            )
        )
        self._zone_words = caption(words, self.zone)
        self._up = ChoiceBox(tr("Axis that points up"), tr("How the part stands"), UPS)
        self.add_row(self._zone_words, self.zone)
        self.add_row(caption(tr("Up"), self._up), self._up)
        self.zone.textChanged.connect(lambda _text: self.show_choice())
        self._up.textActivated.connect(self.up_changed)

    def show_model(self, read: ReadModel) -> None:
        """Show a part and its offers; surfaces without a reason against them are selected."""
        self._read, self._offers = read, read.offers
        self._up.setCurrentText(read.up)
        has_free = any(offer.free_form is not None for offer in self._offers)
        self.zone.setVisible(has_free)
        self._zone_words.setVisible(has_free)
        # The zone of a free form is known only from the drawing.
        self.show_lines(
            read.model.part,
            [
                ChoiceLine(
                    _words(offer), tuple(face - 1 for face in offer.faces),
                    not offer.against and offer.free_form is None, offer.against,
                )
                for offer in self._offers
            ],
        )  # fmt: skip

    def chosen(self) -> tuple[Offer, ...]:
        """Return the selection, in the order of the model."""
        return tuple(self._offers[row] for row in self.chosen_rows())

    def zone_mm(self) -> float | None:
        """Return the zone of free forms; None without any, or without a zone."""
        typed, unit = split_unit(self.zone.text())
        found = typed_value(typed)
        value = None if found is None else to_mm(found, unit)
        has_free = any(offer.free_form is not None for offer in self.chosen())
        return value if has_free and value is not None and value in ZONE.quantity else None

    def can_be_taken(self) -> bool:
        """Return whether something is selected, with its zone if needed."""
        chosen = self.chosen()
        lacks_zone = self.zone_mm() is None and any(one.free_form is not None for one in chosen)
        return bool(chosen) and not lacks_zone

    def said(self) -> str:
        """Return the number of selected surfaces, and whether a zone is missing."""
        count = len(self.chosen_rows())
        words = tr("%n of {all} surfaces are chosen.", "1 of {all} surfaces is chosen.", count)
        words = words.format(all=len(self._offers))
        if count and not self.can_be_taken():
            missing = tr("Enter the profile of free forms.")
            words = f"{words} {missing}"
        return words if self._read is None else f"{words}\n{self._faces(self._read)}"

    def _faces(self, read: ReadModel) -> str:
        """Return the number of imported faces, and reasons against the others."""
        account = read.account(self.chosen())
        listed = {offer.against for offer in self._offers}
        others = [
            f"{said(why)} ({count})"
            for why, count in account.left_out
            if why in read.model.not_measured and why not in listed
        ]
        sentences = (said(account.sentence()), said(account.recognised_sentence()))
        return "\n".join((" ".join(filter(None, sentences)), *others))

    def about(self, row: int) -> str:
        """Return the reason against a surface, or that there is none."""
        offer = self._offers[row]
        name = offer.feature.name
        if offer.against:
            return tr("{name}: {why}.").format(name=name, why=offer.against)
        if offer.free_form is not None:
            words = tr("{name}: points and their profile against the model.")
            return words.format(name=name)
        return tr("{name} can be touched.").format(name=name)


def _words(offer: Offer) -> str:
    """Return a line: name, shape, size, and reason against it."""
    feature = offer.feature
    size = f"\N{LATIN CAPITAL LETTER O WITH STROKE} {millimetres(feature.diameter)}"
    if not feature.diameter:
        size = " \N{MULTIPLICATION SIGN} ".join(
            millimetres(side, decimals=1) for side in (feature.length, feature.width)
        )
    shape = shape_word(feature.shape) if offer.free_form is None else tr("Free form")
    words = f"{feature.name}   {shape}   {size}"
    return f"{words}   \N{EN DASH} {offer.against}" if offer.against else words
