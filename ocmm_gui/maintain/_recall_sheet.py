"""Recall: older jobs recalculated; totals in large words, and every verdict in a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.export import write_together
from ocmm_core.inspection.archive import (
    KeptPlaces,
    RecallRecord,
    checked,
    decide,
    decided,
    headline,
    not_judged,
    recall,
    totals,
)
from ocmm_gui.archive import RecallTable, mark_of
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    ActionInfo,
    FitText,
    PathPanel,
    Teller,
    Theme,
    WorkSheet,
    later,
    mark_colour,
    sentence_label,
    tr,
)
from ocmm_gui.reports import drawing, pdf_bytes

_KEYS = (
    ActionInfo(
        "folder", later("Recall a folder"),
        later("Recalculate the suspect jobs in a folder"), ("F7",),
    ),
    ActionInfo("stop", later("Stop"), later("Stop recalculating; nothing is changed"), ("F9",)),
    ActionInfo("pages", later("Write PDF"), later("Write the recall report (PDF)"), ("F6",)),
    ActionInfo(
        "decide", later("Release points"),
        later("Release points whose verdicts hold, under your name"),
        ("F8",),
    ),
)  # fmt: skip


_MOST_LINES = 3
"""Of jobs that were not judged: the table below needs the room."""


@dataclass(frozen=True, slots=True)
class _Recalling:
    places: KeptPlaces

    def __call__(self, tell: Teller) -> RecallRecord:
        return recall(self.places, datetime.now(UTC), tell)


@dataclass(frozen=True, slots=True)
class _Deciding:
    record: RecallRecord
    places: KeptPlaces
    who: str

    def __call__(self, tell: Teller) -> RecallRecord:
        tell(later("Storing the recall"), 0.5)
        tell.commit()
        return decide(self.record, self.places, self.who, datetime.now(UTC))


@dataclass(frozen=True, slots=True)
class _Writing:
    record: RecallRecord
    path: Path

    def __call__(self, tell: Teller) -> Path:
        tell(later("Creating the pages"), 0.3)
        with drawing():
            content = pdf_bytes(self.record)
        tell.commit()
        write_together({self.path: content})
        return self.path


class RecallSheet(WorkSheet):
    """Recalculate the jobs of a folder in a process of their own and show what came out.

    Parameters
    ----------
    folder
        Gives the folder that is proposed.
    calibrations, probes
        Give where the records are kept.
    who
        Gives the name of who decides.
    """

    def __init__(
        self,
        folder: Callable[[], Path],
        calibrations: Callable[[], Path],
        probes: Callable[[], Path | None],
        who: Callable[[], str],
    ) -> None:
        super().__init__(tr("Recall"), _KEYS, tr("Recalculating the jobs"))
        self._proposed, self._calibrations, self._probes = folder, calibrations, probes
        self._who = who
        self._theme = THEMES[DEFAULT_THEME]
        self._asked: KeptPlaces | None = None
        self._places: KeptPlaces | None = None  # those of the record that is shown
        self._record: RecallRecord | None = None
        self.file = PathPanel(
            tr("Recall the jobs from the folder"), tr("Folder of the jobs"), tr("Recall")
        )
        self.pages = PathPanel(
            tr("Write the recall into the file"), tr("File of the recall"), tr("Write")
        )
        self._headline = FitText(tr("Result of the recall"), limit=26)
        self._headline.setFixedHeight(40)
        self.totals = sentence_label(tr("Findings of the recall"), 15)
        self.table = RecallTable()
        self.about_job = sentence_label(tr("Evidence for the selected verdict"), 14)
        self.about_job.setProperty("role", "muted")
        for widget in (self.file, self.pages, self.working, self._headline, self.totals):
            self.body.addWidget(widget)
        self.body.addWidget(self.table, 1)
        self.body.addWidget(self.about_job)
        self.file.given.connect(self.read)
        self.pages.given.connect(self.write)
        self.table.itemSelectionChanged.connect(lambda: self.about_job.setText(self.table.line()))
        self.use_keys(
            {
                "folder": lambda: self.file.ask(self._folder()),
                "stop": self.stop,
                "pages": self.ask_for_pages,
                "decide": self.release,
            },
            primary="folder",
        )
        self.say(tr("Select the folder with the jobs (F7). Job files are not changed."))

    def open(self) -> None:
        """Recall the jobs of the folder where they are kept, unless some are shown already."""
        if self._record is None and not self._work.is_running():
            self.read(self._proposed())
        self.table.setFocus()

    def read(self, folder: Path) -> None:
        """Recall the jobs of a folder; the window stays free."""
        self._asked = KeptPlaces((folder,), self._calibrations(), self._probes())
        self._begin(tr("Starting"), _Recalling(self._asked))
        self.say(
            tr("Checks the jobs in {folder}. Job files are not changed.").format(folder=folder)
        )
        self.table.setFocus()

    def release(self) -> None:
        """Let the points count again whose verdicts hold, in the name of the operator."""
        record, places = self._shown()
        if record is None or places is None:
            return
        self._asked = places
        self._begin(tr("Storing the recall"), _Deciding(record, places, self._who()))

    def ask_for_pages(self) -> None:
        """Ask where the pages go."""
        record, _ = self._shown()
        if record is not None:
            self.pages.ask(self._folder() / f"recall-{record.made_utc[:10]}.pdf")

    def write(self, path: Path) -> None:
        """Write the recall as pages."""
        record, _ = self._shown()
        if record is not None:
            self._begin(tr("Creating the pages"), _Writing(record, path))

    def headline(self) -> str:
        """Return the totals in large words; for tests."""
        return self._headline.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.table.set_theme(theme)
        if self._record is not None:
            self._show_words(self._record)

    def _folder(self) -> Path:
        return self._places.jobs[0] if self._places is not None else self._proposed()

    def _shown(self) -> tuple[RecallRecord | None, KeptPlaces | None]:
        """Return what is shown; tell where there is nothing, or something is calculated."""
        if self._work.is_running():
            self.failed.emit(
                InputError(
                    "recall.busy",
                    "The recall is still running.",
                    "Wait until it is finished, or stop it (F9).",
                )
            )
            return None, None
        if self._record is None:
            self.failed.emit(
                InputError(
                    "recall.nothing", "No recall is shown yet.", "Recall a folder first (F7)."
                )
            )
            return None, None
        return self._record, self._places

    def _show(self, answer: object) -> None:
        if isinstance(answer, Path):
            self.pages.hide()
            self.told.emit(tr("Recall written to {path}.").format(path=answer))
        elif isinstance(answer, RecallRecord):
            self._record, self._places = answer, self._asked
            self.file.hide()
            self.say(checked(answer))
            self._show_words(answer)
            self.table.show_record(answer)
            self.about_job.setText(self.table.line())
            self.table.setFocus()

    def _show_words(self, record: RecallRecord) -> None:
        mark = mark_of(record)
        self._headline.show_text(headline(record), mark_colour(self._theme, mark), mark)
        said = (*totals(record), decided(record)) if record.jobs else ()
        self.totals.setText("\n".join((*said, *not_judged(record, _MOST_LINES))))
