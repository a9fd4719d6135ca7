"""A recall over the archive: finding, name and results; computed and stored in a side process."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from ocmm_core.calibration.records import default_folder
from ocmm_core.errors import InputError
from ocmm_core.inspection.archive import RecallRecord
from ocmm_gui.archive._labelled import labelled
from ocmm_gui.archive._recall_result import RecallResult, WritingRecall
from ocmm_gui.archive._sheet_texts import read_day
from ocmm_gui.kit import ChoiceBox, FormField, Theme, form_field, language_in_use, later, tr
from ocmm_gui.work import Teller
from ocmm_shop.archive.outbox import ArchivePlace
from ocmm_shop.archive.stores import open_archive
from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive


@dataclass(frozen=True, slots=True)
class Recalling:
    """Recall the archived jobs affected by a finding; changes nothing."""

    places: ShopPlaces
    finding: ArchiveFinding | None

    def __call__(self, tell: Teller) -> RecallRecord:
        """Return the recall; errors as those of `recall_archive`."""
        return recall_archive(self.places, datetime.now(UTC), tell, finding=self.finding)


@dataclass(frozen=True, slots=True)
class Storing:
    """Store a recall with its marks, in a person's name."""

    places: ShopPlaces
    record: RecallRecord
    who: str

    def __call__(self, tell: Teller) -> RecallRecord:
        """Return the recall as stored; errors as those of `decide_archived`."""
        tell(later("Storing the recall"), 0.5)
        with open_archive(self.places.address, password=self.places.password) as archive:
            tell.commit()
            return decide_archived(archive, self.record, self.who, datetime.now(UTC))[0]


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
        self.result = RecallResult()
        body = QVBoxLayout(self)
        body.setContentsMargins(0, 0, 0, 0)
        body.addLayout(row)
        body.addWidget(self.result, 1)
        self.finding.currentIndexChanged.connect(lambda _index: self._show_fields())
        self._show_fields()

    def work(self, place: ArchivePlace) -> Recalling:
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
        return Recalling(self._places, finding)

    def storing(self) -> Storing:
        """Return the work that stores the displayed recall; InputError without recall or name."""
        record = self.result.record
        if record is None or self._places is None:
            raise _nothing()
        return Storing(self._places, record, self.fields["who"].text().strip())

    def writing(self, path: Path) -> WritingRecall:
        """Return the work that writes the displayed recall; InputError without one."""
        if self.result.record is None:
            raise _nothing()
        return WritingRecall(self.result.record, path, language_in_use())

    def show_record(self, record: RecallRecord) -> str:
        """Show a recall, and return the sentence about the checked jobs."""
        return self.result.show_record(record)

    def set_theme(self, theme: Theme) -> None:
        self.finding.set_theme(theme)
        self.result.set_theme(theme)

    def _show_fields(self) -> None:
        named = self.finding.currentIndex() > 0
        for key in ("what", "since"):
            self._holders[key].setVisible(named)


def _nothing() -> InputError:
    return InputError("recall.nothing", tr("No recall is shown yet."), tr("Recall first (F8)."))
