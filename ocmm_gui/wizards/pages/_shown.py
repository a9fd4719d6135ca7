"""Types, facts, fields and texts shared by the parts of a wizard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias, TypeVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QScrollArea, QVBoxLayout, QWidget

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import ProcedureDecision, ProcedureView
from ocmm_core.tables import TableReader
from ocmm_gui import kit
from ocmm_gui.kit import Mark, PlainLabel, later, said, sentence_label, text_font, tr

Watcher: TypeAlias = Callable[[FrameBlock], None]
Tap: TypeAlias = Callable[[Watcher | None], None]
"""Sends every block of frames to a watcher from now on, or to none."""
TemperatureReadings: TypeAlias = Callable[[], Sequence[float | None]]
"""Returns the sensor temperatures, degrees Celsius; empty if unknown."""


V = TypeVar("V")


class StepView(Protocol):
    """Common part of all snapshots."""

    @property
    def base(self) -> ProcedureView: ...

    @property
    def outcome(self) -> object | None:
        """Return the result; None before calculation."""
        ...


@dataclass(frozen=True, slots=True)
class StepSnapshot:
    """State for display."""

    view: StepView
    automatic: bool
    calculating_s: float | None
    """Duration of the running calculation, s; None if none is running."""

    @property
    def complete(self) -> bool:
        """Return whether nothing more is taken; a step without anything to take is complete."""
        step = self.view.base.step
        return step.gate.open and (bool(step.wanted) or not self.view.base.live.ready)

    def view_as(self, kind: type[V]) -> V:
        """Return the snapshot as a page's type; TypeError for an error in `_registry`."""
        if not isinstance(self.view, kind):
            raise TypeError(f"the page shows {kind.__name__}, not {type(self.view).__name__}")
        return self.view


def figures_area(told: QVBoxLayout) -> QScrollArea:
    """Return a scrollable area of figures and reasons, for small windows."""
    holder = QWidget()
    holder.setLayout(told)
    area = kit.dressed(kit.scrolled(holder), tr("Figures and reasons"))
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    return area


class Facts(QWidget):
    """Captions with values, one per line; long values wrap."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._rows: dict[str, QLabel] = {}
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(12)
        self._grid.setVerticalSpacing(6)
        self._grid.setColumnStretch(1, 1)

    def show_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Show captions with values; remove others."""
        named = dict(facts)
        for caption in [one for one in self._rows if one not in named]:
            for label in (self._rows.pop(caption), *self.findChildren(QLabel, caption)):
                label.hide()
                label.deleteLater()
        for caption, value in facts:
            if caption not in self._rows:
                self._add(caption)
            if self._rows[caption].text() != value:
                self._rows[caption].setText(value)

    def value(self, caption: str) -> str:
        return self._rows[caption].text()

    def _add(self, caption: str) -> None:
        row = self._grid.rowCount()
        left = kit.dressed(PlainLabel(caption), font=text_font(16), role="muted", key=caption)
        left.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
        right = sentence_label(caption, 16)
        self._grid.addWidget(left, row, 0)
        self._grid.addWidget(right, row, 1)
        self._rows[caption] = right


@dataclass(frozen=True, slots=True)
class Field:
    key: str
    label: str
    tip: str
    proposal: str = ""
    choices: tuple[tuple[str, str], ...] = ()
    """Permitted values with their texts; the first is proposed."""
    table: TableReader | None = None
    """Reader of the table that the field names; the import page shows it before the start."""
    only_with: tuple[str, str] = ("", "")
    """Key and value of the choice that needs the table."""


WHO = Field("who", later("Done by"), later("Your name, for the record"))
TEMPERATURE = Field(
    "temperature",
    later("Temperature, °C"),
    later("Of the room; empty: the thermometer is read"),
    "",
)
THERMOMETER = Field(
    "thermometer", later("Thermometer U, K"), later("U (k = 2), K, or its id in the register")
)


def gate_words(seen: StepSnapshot, accepted: str, *, going_on: bool) -> tuple[str, Mark]:
    """Return the sentence with its mark.

    `accepted`: Consequence of accepting the result.
    `going_on`: The next step is entered automatically.
    """
    base = seen.view.base
    gate = base.step.gate
    if base.decision is not ProcedureDecision.OPEN and not is_unstored(base):
        ended = (
            accepted if base.decision is ProcedureDecision.ACCEPTED else tr("Nothing was changed.")
        )
        return tr("{ended} Press Esc to leave.").format(ended=ended), Mark.GOOD
    if base.current == len(base.steps) - 1:
        if base.error is not None and seen.view.outcome is None:
            return tr("No result to accept; see the reason and remedy above."), Mark.DOUBT
        if seen.view.outcome is None:
            return tr("Nothing to accept yet: calculate the result first."), Mark.DOUBT
        return said(gate.remedy), Mark.ACTIVE
    if gate.open:
        return tr("Complete: continuing.") if going_on else tr(
            "Next is ready: press Return."
        ), Mark.GOOD
    return tr("Next is locked: {reason} {remedy}").format(
        reason=said(gate.reason), remedy=said(gate.remedy)
    ), Mark.DOUBT


def is_unstored(base: ProcedureView) -> bool:
    """Return whether the program ended between acceptance and storing."""
    return base.decision is ProcedureDecision.ACCEPTED and not base.stored


@dataclass(frozen=True, slots=True)
class EndTexts:
    """Final texts of a wizard."""

    accept: str
    keep: str
    accepts: str
    keeps: str
    """`accepts`, `keeps`: confirmation questions."""


CALIBRATION_ENDS = EndTexts(
    later("Accept the new"), later("Keep the old"),
    later("Activate this calibration?"), later("End and keep the old calibration?"),
)  # fmt: skip
VERDICT_ENDS = EndTexts(
    later("Store the verdict"),
    later("Discard"),
    later("Store this verdict?"),
    later("End without a verdict?"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WizardTexts:
    title: str
    purpose: str
    ends: EndTexts
    accepted: str
    """Consequence of accepting the result."""


def practice_title(title: str) -> str:
    return tr("PRACTICE: {title}").format(title=title)
