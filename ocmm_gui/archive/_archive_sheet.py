"""The Archive page: choose a question, say what it is about, look at the answer, export it."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

from PySide6.QtCore import QStringListModel, Qt
from PySide6.QtWidgets import QCompleter, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from ocmm_core.archive import (
    QUESTIONS,
    USES,
    ArchiveAnswer,
    ArchivePlace,
    Asked,
    HandOver,
    export_answer,
)
from ocmm_core.errors import InputError, OcmmError
from ocmm_gui.archive._answer_table import AnswerTable
from ocmm_gui.archive._asking import Answered, Asking
from ocmm_gui.charts import TrendChart
from ocmm_gui.kit import (
    ActionInfo,
    ChoiceBox,
    FormField,
    PathPanel,
    Theme,
    WorkSheet,
    caption,
    form_field,
    later,
    sentence_label,
    tr,
)

_KEYS = (
    ActionInfo("ask", later("Ask"), later("Ask the archive"), ("F8",)),
    ActionInfo("next", later("Next question"), later("Choose the next question"), ("F6",)),
    ActionInfo(
        "export", later("Export"), later("Write the table to a file, .csv or .parquet"), ("F7",)
    ),
    ActionInfo("stop", later("Stop"), later("Stop asking; what is shown stays"), ("F9",)),
)
_TITLES = {
    "today": later("What was measured"),
    "trend": later("Trend of a characteristic"),
    "used": later("Which jobs used this"),
    "cpk": later("Cpk by month"),
    "passed": later("Who passed what"),
    "rr": later("R&R over stations"),
}
_FIELDS = (
    ("part", later("Part"), later("name of the part")),
    ("characteristic", later("Characteristic"), later("as in the plan")),
    ("what", later("What"), later("hash, serial number or name")),
    ("operator", later("Operator"), later("empty: all")),
    ("station", later("Station"), later("empty: all")),
    ("first", later("From"), later("day, e.g. 2026-11-26; empty: today")),
    ("last", later("To"), later("day; empty: the same")),
)
_MOST_NOTES = 5


class ArchiveSheet(WorkSheet):
    """Ask the archive in a process of its own; the window stays free.

    Parameters
    ----------
    place
        Gives archive and outbox by the settings; None where the archive is off.
    folder
        Where exported files are proposed.
    """

    def __init__(
        self, place: Callable[[], ArchivePlace | None], folder: Callable[[], Path]
    ) -> None:
        super().__init__(tr("Archive"), _KEYS, tr("Asking the archive"))
        self._place, self._proposed = place, folder
        self._answer: ArchiveAnswer | None = None
        self.question = ChoiceBox(
            tr("Question"), tr("What is asked of the archive"),
            [tr(_TITLES[one.name]) for one in QUESTIONS],
        )  # fmt: skip
        self.kind = ChoiceBox(tr("Kind"), tr("What was used"), USES)
        self.fields: dict[str, FormField] = {}
        self._holders: dict[str, QWidget] = {}
        row = QHBoxLayout()
        row.setSpacing(10)
        row.addWidget(caption(tr("Question"), self.question))
        row.addWidget(self.question)
        self._holders["kind"] = _holder(caption(tr("Kind"), self.kind), self.kind)
        row.addWidget(self._holders["kind"])
        for key, name, tip in _FIELDS:
            field = form_field(tr(name), tr(tip))
            self.fields[key] = field
            self._holders[key] = _holder(caption(tr(name), field), field)
            row.addWidget(self._holders[key], 1)
        self._parts, self._characteristics = QStringListModel(), QStringListModel()
        for key, model in (("part", self._parts), ("characteristic", self._characteristics)):
            completer = QCompleter(model, self)
            completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
            completer.setFilterMode(Qt.MatchFlag.MatchContains)
            self.fields[key].setCompleter(completer)
        self.target = PathPanel(
            tr("Write the table to the file"), tr("File of the table"), tr("Write")
        )
        self.table, self.chart = AnswerTable(), TrendChart()
        self.notes = sentence_label(tr("What must be known about the answer"), 15)
        self.standing = sentence_label(tr("Hand-over to the archive"), 14)
        self.standing.setProperty("role", "muted")
        middle = QHBoxLayout()
        middle.setSpacing(10)
        middle.addWidget(self.table, 55)
        middle.addWidget(self.chart, 45)
        self.body.addLayout(row)
        self.body.addWidget(self.target)
        self.body.addWidget(self.working)
        self.body.addLayout(middle, 1)
        self.body.addWidget(self.notes)
        self.body.addWidget(self.standing)
        self.question.currentIndexChanged.connect(lambda _index: self._show_fields())
        self.fields["part"].textChanged.connect(lambda _text: self._offer())
        self.target.given.connect(self._write)
        self._known: tuple[tuple[str, str], ...] = ()
        self.use_keys(
            {"ask": self.ask, "next": self._next, "export": self.export, "stop": self.stop},
            primary="ask",
        )
        self._show_fields()

    def open(self) -> None:
        """Ask what was measured today, or what was asked last."""
        self.question.setFocus()
        self.ask()

    def ask(self) -> None:
        """Ask the chosen question; the window stays free."""
        place = self._place_now()
        if place is None:
            return
        asked = self.attempt(self._asked)
        if asked is None:
            return
        question = QUESTIONS[self.question.currentIndex()]
        missing = [key for key in question.needs if not self.fields[key].text().strip()]
        name = "" if missing else question.name
        self._begin(tr("Asking the archive"), Asking(place, name, asked))
        if missing:
            self.say(tr("Fill in what it is about, then ask (F8)."))
            self.fields[missing[0]].setFocus()

    def export(self) -> None:
        """Ask where the table of what is shown goes."""
        if self._answer is None:
            self.say(tr("Ask first (F8): there is no table yet."))
            return
        self.target.ask(self._proposed() / "archive.csv")

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self.table.set_theme(theme)
        self.chart.set_theme(theme)
        self.question.set_theme(theme)
        self.kind.set_theme(theme)

    def show_standing(self, standing: HandOver) -> None:
        """Show how the hand-over stands, in words of the core."""
        self.standing.setText(standing.line or tr("Everything measured here is in the archive."))

    def _show(self, answer: object) -> None:
        if not isinstance(answer, Answered):
            return
        self._known = answer.parts
        self._parts.setStringList(sorted({part for part, _ in answer.parts}))
        self._offer()
        self.show_standing(answer.standing)
        if answer.answer is None:
            return
        self._answer = answer.answer
        self.say(
            tr("{title}: {count} rows. {place}").format(
                title=answer.answer.title, count=len(answer.answer.rows), place=answer.place
            )
        )
        self.table.show_answer(answer.answer)
        trends = answer.answer.trends
        self.chart.setVisible(bool(trends))
        self.chart.show_trend(trends[0] if trends else None)
        self.notes.setText(" ".join(answer.answer.notes[:_MOST_NOTES]))
        if self.table.rowCount():
            self.table.selectRow(0)

    def _write(self, path: Path) -> None:
        if self._answer is None:
            return
        self.target.hide()
        try:
            export_answer(self._answer, path)
        except OcmmError as error:
            self.failed.emit(error)
            return
        self.say(tr("Table written to {path}.").format(path=path))

    def _next(self) -> None:
        self.question.setCurrentIndex((self.question.currentIndex() + 1) % self.question.count())
        self.ask()

    def _show_fields(self) -> None:
        takes = QUESTIONS[self.question.currentIndex()].takes
        for key, holder in self._holders.items():
            holder.setVisible(key in takes)
        self.chart.setVisible(QUESTIONS[self.question.currentIndex()].name == "trend")

    def _offer(self) -> None:
        part = self.fields["part"].text().strip()
        self._characteristics.setStringList(
            sorted({name for one, name in self._known if one == part or not part})
        )

    def _asked(self) -> Asked:
        text = {key: field.text().strip() for key, field in self.fields.items()}
        return Asked(
            station=text["station"], part=text["part"], characteristic=text["characteristic"],
            operator=text["operator"], kind=USES[self.kind.currentIndex()], what=text["what"],
            first=_day(text["first"]), last=_day(text["last"]),
        )  # fmt: skip

    def _place_now(self) -> ArchivePlace | None:
        try:
            place = self._place()
        except OcmmError as error:
            self.failed.emit(error)
            return None
        if place is None:
            self.say(tr("The archive is off. Turn it on in Settings (Ctrl+,)."))
        return place


def _holder(label: QLabel, field: QWidget) -> QWidget:
    holder = QWidget()
    layout = QVBoxLayout(holder)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(2)
    layout.addWidget(label)
    layout.addWidget(field)
    return holder


def _day(text: str) -> date | None:
    if not text:
        return None
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise InputError(
            "archive.day",
            tr("{text} is no day.").format(text=text),
            tr("Write it like 2026-11-26."),
        ) from None
