"""A recall over the archive: finding, name, totals in large words, and a row per characteristic.

It is computed and stored in a side process.
"""

from __future__ import annotations

from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.records import default_folder
from ocmm_core.errors import InputError
from ocmm_core.export import write_together
from ocmm_core.inspection import recall
from ocmm_core.inspection.finished import Outcome, RecallRecord
from ocmm_core.inspection.recall import row
from ocmm_core.wording import Speech
from ocmm_gui import kit
from ocmm_gui.archive._archive_words import labelled, read_day
from ocmm_gui.kit import later, tr
from ocmm_gui.reports import drawing, pdf_bytes
from ocmm_gui.work import Teller, Work
from ocmm_shop.archive.outbox import ArchivePlace
from ocmm_shop.archive.stores import open_archive
from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive

_TIPS = (
    later("file of the job"),
    later("as in the plan"),
    later("value ± U and verdict with the calibration of the job"),
    later("the same with the calibration its spots support"),
    later("whether the verdict still holds"),
    later("and why"),
)
_MARKS = {
    Outcome.HOLDS: kit.Mark.GOOD,
    Outcome.CHANGES: kit.Mark.BAD,
    Outcome.UNKNOWN: kit.Mark.DOUBT,
}


def mark_of(record: RecallRecord) -> kit.Mark:
    """Return the mark of a recall: that of its worst verdict."""
    worst = next(
        (one for one in (Outcome.CHANGES, Outcome.UNKNOWN) if record.count(one)), Outcome.HOLDS
    )
    return kit.Mark.DOUBT if record.unread and worst is Outcome.HOLDS else _MARKS[worst]


class RecallTable(kit.DataTable):
    """One row per characteristic, urgent jobs first."""

    def __init__(self) -> None:
        super().__init__(
            tr("Verdicts of the recall"),
            tuple(zip(map(kit.said_word, recall.COLUMNS), kit.tr_all(_TIPS), strict=True)),
        )
        self._lines: list[str] = []
        self.setItemDelegate(kit.ColouredRow(self))
        self.resizeColumnsToContents()

    def show_record(self, record: RecallRecord) -> None:
        rows = [
            (job, one) for job in recall.worst_first(record.jobs) for one in job.characteristics
        ]
        speech = Speech(kit.language_in_use())
        self._lines = [
            f"{recall.job_line(job, speech)} {kit.said(recall.rests_on(job))}" for job, _ in rows
        ]
        self.setRowCount(len(rows))
        for at, (job, one) in enumerate(rows):
            colours = {4: _MARKS[one.outcome].colour}
            self.show_words(at, (job.label, *row(one, speech)), colours)
        self.resizeColumnsToContents()
        if rows:
            self.selectRow(0)

    def line(self) -> str:
        """Return the evidence of the selected row; empty without one."""
        at = self.currentRow()
        return self._lines[at] if 0 <= at < len(self._lines) else ""


_MOST_LINES = 3
"""Of jobs that were not judged: the table below needs the room."""


class RecallResult(QWidget):
    """Result of any recall."""

    def __init__(self) -> None:
        super().__init__()
        self.record: RecallRecord | None = None
        self.headline = kit.FitText(tr("Result of the recall"), limit=26, high=40)
        self.totals = kit.sentence_label(tr("Findings of the recall"), 15)
        self.table = RecallTable()
        self.about_job = kit.sentence_label(
            tr("Evidence for the selected verdict"), 14, role="muted"
        )
        kit.vbox(
            self.headline, self.totals, (self.table, 1), self.about_job, parent=self, margins=0
        )
        self.table.itemSelectionChanged.connect(self._show_job)

    def show_record(self, record: RecallRecord) -> str:
        """Show a recall, and return the sentence about the checked jobs."""
        self.record = record
        self.headline.show_text(
            recall.headline(record, Speech(kit.language_in_use())), mark=mark_of(record)
        )
        found = (*recall.totals(record), recall.decided(record)) if record.jobs else ()
        lines = (*found, *recall.not_judged(record, _MOST_LINES))
        self.totals.setText("\n".join(map(kit.said, lines)))
        self.table.show_record(record)
        self._show_job()
        return kit.said(recall.checked(record))

    def _show_job(self) -> None:
        self.about_job.setText(self.table.line())


def write_recall(record: RecallRecord, path: Path, language: str, tell: Teller) -> Path:
    """Return the written file of the pages of a recall, in a language."""
    tell(later("Creating the pages"), 0.3)
    with drawing():
        content = pdf_bytes(record, language)
    tell.commit()
    write_together({path: content})
    return path


def _recalled(places: ShopPlaces, finding: ArchiveFinding | None, tell: Teller) -> RecallRecord:
    """Return the archived jobs affected by a finding; errors as those of `recall_archive`."""
    return recall_archive(places, datetime.now(UTC), tell, finding=finding)


def _stored(places: ShopPlaces, record: RecallRecord, who: str, tell: Teller) -> RecallRecord:
    """Return a recall as stored in a person's name; errors as those of `decide_archived`."""
    tell(later("Storing the recall"), 0.5)
    with open_archive(places.address, password=places.password) as archive:
        tell.commit()
        return decide_archived(archive, record, who, datetime.now(UTC))[0]


_FINDINGS = (
    ("", later("what the histories tell")),
    ("artefact", later("artefact")),
    ("tip", later("tip")),
    ("calibration", later("calibration")),
)
_FIELDS = (
    ("what", later("What"), later("serial number, name or hash")),
    ("since", later("Wrong since"), later("day, e.g. 2026-11-26")),
    ("folders", later("Calibrations"), later("folders of the stations; empty: this computer")),
    ("who", later("Name"), later("who decides; to store it")),
)


class RecallPanel(QWidget):
    """Fields of a finding above the results."""

    def __init__(self) -> None:
        super().__init__()
        self._places: ShopPlaces | None = None
        self.finding = kit.ChoiceBox(
            tr("Finding"), tr("What was found to be wrong"), [tr(name) for _, name in _FINDINGS]
        )
        self.fields: dict[str, kit.FormField] = {}
        row = kit.hbox(labelled(tr("Finding"), self.finding), spacing=10)
        self._holders: dict[str, QWidget] = {}
        for key, name, tip in _FIELDS:
            self.fields[key] = kit.form_field(tr(name), tr(tip))
            self._holders[key] = labelled(tr(name), self.fields[key])
            row.addWidget(self._holders[key], 2 if key == "folders" else 1)
        self.result = RecallResult()
        kit.vbox(row, (self.result, 1), parent=self, margins=0)
        self.finding.currentIndexChanged.connect(lambda _index: self._show_fields())
        self._show_fields()

    def work(self, place: ArchivePlace) -> Work:
        """Return the work that computes the recall; InputError for a missing or wrong field."""
        text = {key: field.text().strip() for key, field in self.fields.items()}
        kind = _FINDINGS[self.finding.currentIndex()][0]
        finding = None
        if kind:
            if not text["what"] or not text["since"]:
                raise InputError(
                    "recall.finding",
                    tr("What was wrong, or since when, is missing."),
                    tr("Fill in both, then recall (F8)."),
                )
            finding = ArchiveFinding(
                kind, text["what"], read_day(text["since"], datetime.fromisoformat).astimezone()
            )
        folders = tuple(
            Path(one.strip()).expanduser() for one in text["folders"].split(";") if one.strip()
        )
        self._places = ShopPlaces(
            place.address, folders or (default_folder(),), None, place.password
        )
        return partial(_recalled, self._places, finding)

    def storing(self) -> Work:
        """Return the work that stores the displayed recall; InputError without recall or name."""
        record = self.result.record
        if record is None or self._places is None:
            raise _nothing()
        return partial(_stored, self._places, record, self.fields["who"].text().strip())

    def writing(self, path: Path) -> Work:
        """Return the work that writes the displayed recall; InputError without one."""
        if self.result.record is None:
            raise _nothing()
        return partial(write_recall, self.result.record, path, kit.language_in_use())

    def _show_fields(self) -> None:
        named = self.finding.currentIndex() > 0
        for key in ("what", "since"):
            self._holders[key].setVisible(named)


def _nothing() -> InputError:
    return InputError("recall.nothing", tr("No recall is shown yet."), tr("Recall first (F8)."))
