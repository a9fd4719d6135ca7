"""The Archive page: a query and its answer, or a recall of all archived jobs."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from functools import partial
from itertools import compress
from pathlib import Path

from PySide6.QtCore import QStringListModel, Qt
from PySide6.QtWidgets import QCompleter, QTableWidgetItem, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import RecallRecord
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_gui import kit
from ocmm_gui.archive import _archive_words as archive_words
from ocmm_gui.archive._recall_panel import RecallPanel
from ocmm_gui.charts import TrendChart
from ocmm_gui.kit import tr
from ocmm_gui.work import WorkSheet
from ocmm_shop.archive.outbox import ArchivePlace, HandOver
from ocmm_shop.archive.questions import QUESTIONS, ArchiveAnswer, Query, export_answer
from ocmm_shop.archive.records import USES, shown_text

_GOOD = (Verdict.CONFORM.value, PartWord.CONFORMS.value)
_BAD = (Verdict.NOT_CONFORM.value, PartWord.DOES_NOT_CONFORM.value)
_DOUBT = (
    Verdict.NOT_PROVEN.value, Verdict.NOT_MEASURED.value, Verdict.PROVISIONAL.value,
    PartWord.NOT_COMPLETE.value,
)  # fmt: skip
_LONGEST = 480


class AnswerTable(kit.DataTable):
    """Rows of an answer; numbers at the right with four decimals."""

    def __init__(self) -> None:
        super().__init__(tr("Answer of the archive"), ())
        self.setWordWrap(False)

    def show_answer(self, answer: ArchiveAnswer | None) -> None:
        self.clear()
        self.setRowCount(0)
        columns = () if answer is None else answer.columns
        self.setColumnCount(len(columns))
        if answer is None:
            return
        # Column names are words of the core, which also exports them; they are not data.
        for column, title in enumerate(columns):
            item = QTableWidgetItem(kit.said_word(title))
            item.setTextAlignment(kit.LEFT)
            self.setHorizontalHeaderItem(column, item)
        self.setRowCount(len(answer.rows))
        numbers = [
            any(isinstance(row[column], int | float) for row in answer.rows)
            for column in range(len(columns))
        ]
        for row, cells in enumerate(answer.rows):
            for column, cell in enumerate(cells):
                self._write(row, column, _text(cell), _colour(cell))
            self.show_digits(row, compress(range(len(columns)), numbers), 13)
        self.right_heads(compress(range(len(columns)), numbers))
        self.resizeColumnsToContents()
        for column in range(len(columns)):
            if self.columnWidth(column) > _LONGEST:
                self.setColumnWidth(column, _LONGEST)
        self.horizontalHeader().setStretchLastSection(bool(columns) and not numbers[-1])


def _colour(cell: object) -> str:
    if cell in _GOOD:
        return "good"
    if cell in _BAD:
        return "bad"
    return "warn" if cell in _DOUBT else "text"


def _text(cell: object) -> str:
    if cell is None:
        return "–"
    return (
        kit.localised(f"{cell:.4f}")
        if isinstance(cell, float)
        else kit.said_word(shown_text(str(cell)))
    )


_MOST_NOTES = 5


class ArchiveSheet(WorkSheet):
    """Query the archive, of ``place`` by the settings, in a side process; ``folder``: exports."""

    def __init__(
        self, place: Callable[[], ArchivePlace | None], folder: Callable[[], Path]
    ) -> None:
        super().__init__(tr("Archive"), archive_words.KEYS, tr("Asking the archive"))
        self._place, self._proposed = place, folder
        self._answer: ArchiveAnswer | None = None
        self.question = kit.ChoiceBox(
            tr("Question"), tr("What is asked of the archive"),
            [tr(archive_words.TITLES[one.name]) for one in QUESTIONS],
        )  # fmt: skip
        self.kind = kit.ChoiceBox(
            tr("Kind"), tr("What was used"), USES, lambda one: tr(archive_words.USE_WORDS[one])
        )
        self.fields: dict[str, kit.FormField] = {}
        self._holders: dict[str, QWidget] = {}
        row = kit.hbox(archive_words.labelled(tr("Question"), self.question), spacing=10)
        self._holders["kind"] = archive_words.labelled(tr("Kind"), self.kind)
        row.addWidget(self._holders["kind"])
        for key, name, tip in archive_words.FIELDS:
            field = kit.form_field(tr(name), tr(tip))
            self.fields[key] = field
            self._holders[key] = archive_words.labelled(tr(name), field)
            row.addWidget(self._holders[key], 1)
        self._parts, self._characteristics = QStringListModel(), QStringListModel()
        for key, model in (("part", self._parts), ("characteristic", self._characteristics)):
            completer = QCompleter(model, self)
            completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
            completer.setFilterMode(Qt.MatchFlag.MatchContains)
            self.fields[key].setCompleter(completer)
        self.target = kit.PathPanel(
            tr("Write the table to the file"), tr("File of the table"), tr("Write")
        )
        self.table, self.chart = AnswerTable(), TrendChart()
        self.notes = kit.sentence_label(tr("What must be known about the answer"), 15)
        self.standing = kit.sentence_label(tr("Hand-over to the archive"), 14, role="muted")
        middle = kit.hbox((self.table, 55), (self.chart, 45), spacing=10)
        self.recall, self._asking = RecallPanel(), QWidget()
        kit.vbox(row, (middle, 1), self.notes, parent=self._asking, margins=0)
        kit.fill(self.body, self.target, self.working, (self._asking, 1), (self.recall, 1))
        self.recall.hide()
        self.body.addWidget(self.standing)
        self.question.currentIndexChanged.connect(lambda _index: self._show_fields())
        self.fields["part"].textChanged.connect(lambda _text: self._offer())
        self.target.given.connect(self._write)
        self._known: tuple[tuple[str, str], ...] = ()
        self.use_keys(
            {
                "ask": self.query,
                "next": self._next,
                "export": self.export,
                "stop": self.stop,
                "recall": self.turn_to_recall,
                "store": self.store,
            },
            primary="ask",
        )
        self._show_fields()

    def open(self) -> None:
        """Query today's jobs, or repeat the last query."""
        self.question.setFocus()
        self.query()

    def query(self) -> None:
        place = self._place_now()
        if place is None:
            return
        if self._recalls():
            work = self.attempt(lambda: self.recall.work(place))
            if work is not None:
                self._start(tr("Recalculating the jobs"), work)
                self.show_message(tr("Checks the archived jobs. Nothing is changed."))
            return
        asked = self.attempt(self._asked)
        if asked is None:
            return
        question = QUESTIONS[self.question.currentIndex()]
        missing = [key for key in question.needs if not self.fields[key].text().strip()]
        work = partial(archive_words.ask_archive, place, "" if missing else question.name, asked)
        self._start(tr("Asking the archive"), work)
        if missing:
            self.show_message(tr("Fill in what it is about, then ask (F8)."))
            self.fields[missing[0]].setFocus()

    def export(self) -> None:
        """Ask for the file of the displayed table or recall."""
        if self._recalls():
            if self.recall.result.record is None:
                self.show_message(tr("Recall first (F8): there are no pages yet."))
                return
            day = self.recall.result.record.made_utc[:10]
            self.target.ask(self._proposed() / f"recall-{day}.pdf")
            return
        if self._answer is None:
            self.show_message(tr("Ask first (F8): there is no table yet."))
            return
        self.target.ask(self._proposed() / "archive.csv")

    def turn_to_recall(self) -> None:
        recalls = not self._recalls()
        self.target.hide()
        self._asking.setVisible(not recalls)
        self.recall.setVisible(recalls)
        (self.recall.finding if recalls else self.question).setFocus()
        if recalls:
            self.show_message(
                tr("Choose what was found wrong, then recall (F8). Nothing is changed.")
            )

    def store(self) -> None:
        if not self._recalls():
            self.show_message(tr("Turn to the recall first (F10)."))
            return
        work = self.attempt(self.recall.storing)
        if work is not None:
            self._start(tr("Storing the recall"), work)

    def show_standing(self, standing: HandOver) -> None:
        self.standing.setText(standing.line or tr("Everything measured here is in the archive."))

    def _recalls(self) -> bool:
        # Valid also before the page is shown.
        return not self.recall.isHidden()

    def _show(self, answer: object) -> None:
        if isinstance(answer, RecallRecord):
            self.show_message(self.recall.result.show_record(answer))
        elif isinstance(answer, Path):
            self.show_message(tr("Recall written to {path}.").format(path=answer))
        if not isinstance(answer, archive_words.ArchiveResult):
            return
        self._known = answer.parts
        self._parts.setStringList(sorted({part for part, _ in answer.parts}))
        self._offer()
        self.show_standing(answer.standing)
        if answer.answer is None:
            return
        self._answer = answer.answer
        self.show_message(
            tr(
                "{title}: %n rows. {place}", "{title}: 1 row. {place}", len(answer.answer.rows)
            ).format(title=kit.said(answer.answer.title), place=answer.place)
        )
        self.table.show_answer(answer.answer)
        trends = answer.answer.trends
        self.chart.setVisible(bool(trends))
        self.chart.show_trend(trends[0] if trends else None)
        self.notes.setText(kit.said(" ".join(answer.answer.notes[:_MOST_NOTES])))
        if self.table.rowCount():
            self.table.selectRow(0)

    def _write(self, path: Path) -> None:
        self.target.hide()
        if self._recalls():
            work = self.attempt(lambda: self.recall.writing(path))
            if work is not None:
                self._start(tr("Creating the pages"), work)
            return
        if self._answer is None:
            return
        try:
            export_answer(self._answer, path)
        except OcmmError as error:
            self.failed.emit(error)
            return
        self.show_message(tr("Table written to {path}.").format(path=path))

    def _next(self) -> None:
        if self._recalls():
            self.turn_to_recall()
        self.question.setCurrentIndex((self.question.currentIndex() + 1) % self.question.count())
        self.query()

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

    def _asked(self) -> Query:
        text = {key: field.text().strip() for key, field in self.fields.items()}
        return Query(
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
            self.show_message(tr("The archive is off. Turn it on in Settings (Ctrl+,)."))
        return place


def _day(text: str) -> date | None:
    return archive_words.read_day(text, date.fromisoformat) if text else None
