"""Recall sheet: older jobs recalculated; large totals, and a table of verdicts."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.inspection.finished import RecallRecord
from ocmm_core.inspection.recall import KeptPlaces, decide, recall
from ocmm_gui.archive import RecallResult, write_recall
from ocmm_gui.kit import ActionInfo, PathPanel, fill, language_in_use, later, tr
from ocmm_gui.work import Teller, WorkSheet

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


def _recalled(places: KeptPlaces, tell: Teller) -> RecallRecord:
    return recall(places, datetime.now(UTC), tell)


def _decided(record: RecallRecord, places: KeptPlaces, who: str, tell: Teller) -> RecallRecord:
    tell(later("Storing the recall"), 0.5)
    tell.commit()
    return decide(record, places, who, datetime.now(UTC))


class RecallSheet(WorkSheet):
    """Recalculate the jobs of a folder in a separate process and show the results."""

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
        self._asked: KeptPlaces | None = None
        self._places: KeptPlaces | None = None  # of the displayed record
        self.file = PathPanel(
            tr("Recall the jobs from the folder"), tr("Folder of the jobs"), tr("Recall")
        )
        self.pages = PathPanel(
            tr("Write the recall into the file"), tr("File of the recall"), tr("Write")
        )
        self.result = RecallResult()
        fill(self.body, self.file, self.pages, self.working, (self.result, 1))
        self.file.given.connect(self.read)
        self.pages.given.connect(self.write)
        self.use_keys(
            {
                "folder": lambda: self.file.ask(self._folder()),
                "stop": self.stop,
                "pages": self.ask_for_pages,
                "decide": self.release,
            },
            primary="folder",
        )
        self.show_message(tr("Select the folder with the jobs (F7). Job files are not changed."))

    def open(self) -> None:
        """Recall the jobs of the default folder, unless some are shown already."""
        if self.result.record is None and not self._work.is_running():
            self.read(self._proposed())
        self.result.table.setFocus()

    def read(self, folder: Path) -> None:
        """Recall the jobs of a folder, without blocking."""
        self._asked = KeptPlaces((folder,), self._calibrations(), self._probes())
        self._start(tr("Starting"), partial(_recalled, self._asked))
        self.show_message(
            tr("Checks the jobs in {folder}. Job files are not changed.").format(folder=folder)
        )
        self.result.table.setFocus()

    def release(self) -> None:
        """Release the suspect points whose verdicts hold, in the operator's name."""
        record, places = self._shown()
        if record is None or places is None:
            return
        self._asked = places
        self._start(tr("Storing the recall"), partial(_decided, record, places, self._who()))

    def ask_for_pages(self) -> None:
        record, _ = self._shown()
        if record is not None:
            self.pages.ask(self._folder() / f"recall-{record.made_utc[:10]}.pdf")

    def write(self, path: Path) -> None:
        record, _ = self._shown()
        if record is not None:
            self._start(
                tr("Creating the pages"), partial(write_recall, record, path, language_in_use())
            )

    def _folder(self) -> Path:
        return self._places.jobs[0] if self._places is not None else self._proposed()

    def _shown(self) -> tuple[RecallRecord | None, KeptPlaces | None]:
        """Return the displayed recall; report if there is none, or a calculation runs."""
        if self._work.is_running():
            self.failed.emit(
                InputError(
                    "recall.busy",
                    "The recall is still running.",
                    "Wait until it is finished, or stop it (F9).",
                )
            )
            return None, None
        if self.result.record is None:
            self.failed.emit(
                InputError(
                    "recall.nothing", "No recall is shown yet.", "Recall a folder first (F7)."
                )
            )
            return None, None
        return self.result.record, self._places

    def _show(self, answer: object) -> None:
        if isinstance(answer, Path):
            self.pages.hide()
            self.told.emit(tr("Recall written to {path}.").format(path=answer))
        elif isinstance(answer, RecallRecord):
            self._places = self._asked
            self.file.hide()
            self.show_message(self.result.show_record(answer))
            self.result.table.setFocus()
