"""A recall over the archive: the finding, who decides, and the page of what became of the jobs."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from ocmm_core.archive.outbox import ArchivePlace
from ocmm_core.calibration.records import default_folder
from ocmm_core.errors import InputError
from ocmm_core.inspection.archive import (
    RecallRecord,
    checked,
    decided,
    headline,
    not_judged,
    totals,
)
from ocmm_core.recalls import ArchiveFinding, ShopPlaces
from ocmm_gui.archive._labelled import labelled
from ocmm_gui.archive._recall_table import RecallTable, mark_of
from ocmm_gui.archive._recalling import Recalling, Storing, WritingRecall
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    ChoiceBox,
    FitText,
    FormField,
    Theme,
    form_field,
    later,
    mark_colour,
    sentence_label,
    tr,
)

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
_MOST_LINES = 3


class RecallPanel(QWidget):
    """Fields of a finding above what became of the jobs; it computes nothing itself."""

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._places: ShopPlaces | None = None
        self.record: RecallRecord | None = None
        self.finding = ChoiceBox(
            tr("Finding"), tr("What was found to be wrong"), [tr(name) for _, name in _FINDINGS]
        )
        self.fields: dict[str, FormField] = {}
        row = QHBoxLayout()
        row.setSpacing(10)
        row.addWidget(labelled(tr("Finding"), self.finding))
        self._holders: dict[str, QWidget] = {}
        for key, name, tip in _FIELDS:
            self.fields[key] = form_field(tr(name), tr(tip))
            self._holders[key] = labelled(tr(name), self.fields[key])
            row.addWidget(self._holders[key], 2 if key == "folders" else 1)
        self._headline = FitText(tr("Result of the recall"), limit=26)
        self._headline.setFixedHeight(40)
        self.totals = sentence_label(tr("Findings of the recall"), 15)
        self.table = RecallTable()
        self.about_job = sentence_label(tr("Evidence for the selected verdict"), 14)
        self.about_job.setProperty("role", "muted")
        body = QVBoxLayout(self)
        body.setContentsMargins(0, 0, 0, 0)
        body.addLayout(row)
        body.addWidget(self._headline)
        body.addWidget(self.totals)
        body.addWidget(self.table, 1)
        body.addWidget(self.about_job)
        self.table.itemSelectionChanged.connect(lambda: self.about_job.setText(self.table.line()))
        self.finding.currentIndexChanged.connect(lambda _index: self._show_fields())
        self._show_fields()

    def work(self, place: ArchivePlace) -> Recalling:
        """Return what computes the recall; InputError where a field is missing or wrong."""
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
            finding = ArchiveFinding(kind, text["what"], _since(text["since"]))
        folders = tuple(
            Path(one.strip()).expanduser() for one in text["folders"].split(";") if one.strip()
        )
        self._places = ShopPlaces(
            place.address, folders or (default_folder(),), None, place.password
        )
        return Recalling(self._places, finding)

    def storing(self) -> Storing:
        """Return what stores the recall that is shown; InputError where none is, or no name."""
        if self.record is None or self._places is None:
            raise _nothing()
        return Storing(self._places, self.record, self.fields["who"].text().strip())

    def writing(self, path: Path) -> WritingRecall:
        """Return what writes the recall that is shown; InputError where none is."""
        if self.record is None:
            raise _nothing()
        return WritingRecall(self.record, path)

    def show_record(self, record: RecallRecord) -> str:
        """Show what a recall found, and return the sentence about what was looked at."""
        self.record = record
        self._show_words(record)
        self.table.show_record(record)
        self.about_job.setText(self.table.line())
        return checked(record)

    def headline(self) -> str:
        """Return the totals in large words; for tests."""
        return self._headline.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.finding.set_theme(theme)
        self.table.set_theme(theme)
        if self.record is not None:
            self._show_words(self.record)

    def _show_words(self, record: RecallRecord) -> None:
        mark = mark_of(record)
        self._headline.show_text(headline(record), mark_colour(self._theme, mark), mark)
        said = (*totals(record), decided(record)) if record.jobs else ()
        self.totals.setText("\n".join((*said, *not_judged(record, _MOST_LINES))))

    def _show_fields(self) -> None:
        named = self.finding.currentIndex() > 0
        for key in ("what", "since"):
            self._holders[key].setVisible(named)


def _since(text: str) -> datetime:
    try:
        return datetime.fromisoformat(text).astimezone()
    except ValueError:
        raise InputError(
            "archive.day",
            tr("{text} is no day.").format(text=text),
            tr("Write it like 2026-11-26."),
        ) from None


def _nothing() -> InputError:
    return InputError("recall.nothing", tr("No recall is shown yet."), tr("Recall first (F8)."))
