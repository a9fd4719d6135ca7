"""Lists of the start page: cards of the last jobs, and plans for a new job.

A card has the picture, verdict, missing points, operator and time of a job. Plans are recent, in
the plan folder, or shipped.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.work import SideProcess, Teller

if TYPE_CHECKING:
    from ocmm_core.inspection.evaluation import JobView
    from ocmm_core.inspection.finished import LastJob
    from ocmm_core.inspection.plan import PlanSummary


_PICTURE = QSize(112, 72)
_ROW_PX = 84


@dataclass(frozen=True, slots=True)
class JobCardData:
    """Job recomputed from its file, as `reopen_job` returns it, or why it cannot be."""

    path: Path
    view: JobView | None = None
    doubts: tuple[str, ...] = ()
    fault: OcmmError | None = None


def judge_jobs(
    paths: tuple[Path, ...], probes: Path | None, calibrations: Path | None, tell: Teller
) -> None:
    """Send a `JobCardData` for each path; folders as `reopen_job`."""
    from ocmm_core.inspection.finished import reopen_job

    for path in paths:
        try:
            job = reopen_job(path, probes, calibrations=calibrations)
        except OcmmError as fault:
            tell.send(JobCardData(path, fault=fault))
        else:
            tell.send(JobCardData(path, job.view, job.doubts))


class JobCards(kit.Themed, QListWidget):
    """The last jobs; a verdict is shown once it is computed, and never assumed."""

    def __init__(self) -> None:
        super().__init__()
        tip = tr("Up and down select a job; Return goes on with it")
        kit.dressed(self, tr("Last jobs"), tip, font=kit.text_font(16))
        self.setIconSize(_PICTURE)
        self.setWordWrap(True)
        self._jobs: tuple[LastJob, ...] = ()
        self._judged: dict[Path, JobCardData] = {}
        self.judging = SideProcess(self)
        self.judging.came.connect(self.show_verdict)

    def show_jobs(self, jobs: tuple[LastJob, ...]) -> None:
        """List jobs without their verdicts, and select the first readable one."""
        self._jobs, self._judged = jobs, {}
        self.clear()
        for job in jobs:
            item = QListWidgetItem(self)
            item.setToolTip(kit.literal(str(job.path)))
            item.setSizeHint(QSize(200, _ROW_PX))
            self._show(item, job)
        sound = [row for row, job in enumerate(jobs) if job.fault is None]
        if jobs:
            self.setCurrentRow(sound[0] if sound else 0)

    def judge(self, probes: Path | None, calibrations: Path | None) -> None:
        """Compute the verdicts of the listed jobs; folders as `reopen_job`."""
        paths = tuple(job.path for job in self._jobs if job.fault is None and job.points)
        if paths:
            self.judging.start(partial(judge_jobs, paths, probes, calibrations))

    def show_verdict(self, judged: JobCardData) -> None:
        self._judged[judged.path] = judged
        for row, job in enumerate(self._jobs):
            if job.path == judged.path:
                self._show(self.item(row), job)

    def chosen(self) -> Path | None:
        """Return the selected job, or None."""
        row = self.currentRow()
        return self._jobs[row].path if 0 <= row < len(self._jobs) else None

    def _paint(self) -> None:
        for row, job in enumerate(self._jobs):
            self._show(self.item(row), job)

    def _show(self, item: QListWidgetItem, job: LastJob) -> None:
        judged = self._judged.get(job.path)
        item.setText(card_words(job, judged))
        view = None if judged is None else judged.view
        colour = self._theme.text
        if view is not None:
            from ocmm_gui.kit import verdict_colour

            colour = verdict_colour(self._theme, view.part_verdict.shown_as)
        elif job.fault is not None or judged is not None:
            colour = self._theme.bad
        item.setForeground(QColor(colour))
        item.setIcon(QIcon(_picture(judged, self._theme)))


def card_words(job: LastJob, judged: JobCardData | None = None) -> str:
    when = datetime.fromtimestamp(job.changed_s).astimezone()
    moment = f"{kit.time_words(when)} {when.tzname()}"
    fault = job.fault if judged is None or job.fault is not None else judged.fault
    if fault is not None:
        return tr("{name}: cannot be read, {when}\n{why}").format(
            name=job.path.name, when=moment, why=kit.said(fault.what)
        )
    verdict = _progress(job)
    if judged is not None and judged.view is not None:
        # Imported on demand, as all that computes.
        from ocmm_gui.kit import counted_line

        verdict = " ".join((counted_line(judged.view), *map(kit.said, judged.doubts[:1])))
    elif job.simulated:
        verdict = tr("SIMULATED. {verdict}").format(verdict=verdict)
    return tr("{part}, serial {serial}\n{verdict}\n{when}, {operator}, {points}, {name}").format(
        part=job.part, serial=job.serial, verdict=verdict, when=moment, operator=job.operator,
        points=tr("%n points", "1 point", job.points), name=job.path.name,
    )  # fmt: skip


def _progress(job: LastJob) -> str:
    """Return how far a job is; a finished one has no verdict before it is computed."""
    if job.points == 0:
        return tr("no points yet")
    done = tr("{done} of %n features", "{done} of 1 feature", job.features).format(
        done=job.finished
    )
    if job.complete:
        return tr("{done}, verdict follows").format(done=done)
    return tr("paused, {done}").format(done=done) if job.paused else done


def _picture(judged: JobCardData | None, theme: kit.Theme) -> QPixmap:
    """Return a picture of the measured features; empty until they are known."""
    picture = QPixmap(_PICTURE)
    picture.fill(Qt.GlobalColor.transparent)
    if judged is None or judged.view is None:
        return picture
    # Imported on demand: the Start page is shown before what computes is loaded.
    import numpy as np

    from ocmm_gui.scene import Orbit, paint_scene
    from ocmm_gui.views import job_items

    items, places = job_items(judged.view, theme)
    if not len(places):
        return picture
    up = np.array([0.0, 0.0, 1.0])
    orbit = Orbit(np.zeros(3), 0.5, float(np.radians(38.0)), 100.0, up)
    size = (float(_PICTURE.width()), float(_PICTURE.height()))
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    paint_scene(
        painter, [item for item in items if not hasattr(item, "text")],
        orbit.fitted(places, *size, margin=1.3), QRectF(0.0, 0.0, *size), kit.text_font(10),
        theme.panel,
    )  # fmt: skip
    painter.end()
    return picture


_KEYS = (
    kit.ActionInfo("other", later("Other file"), later("Look for another plan file"), ("F9",)),
    kit.ActionInfo("begin", later("Next"), later("Go on with this plan: who measures which part"),
               ("F8",)),
)  # fmt: skip
_PATH = Qt.ItemDataRole.UserRole
_PLAN_ROW_PX = 60


class PlanChoice(kit.Sheet):
    """Plans, newest first."""

    chosen = Signal(object)
    other_wanted = Signal()
    """Browse for another file."""

    def __init__(self) -> None:
        super().__init__(tr("New job: choose the plan"), _KEYS)
        self.list = kit.dressed(QListWidget(), tr("Plans"), font=kit.text_font(18))
        self.list.itemActivated.connect(lambda _item: self._start())
        self.body.addWidget(self.list, 1)
        self.use_keys({"other": self.other_wanted.emit, "begin": self._start}, primary="begin")

    def open(self) -> None:
        """Show that plans are being read; `show_plans` follows."""
        self.list.clear()
        self.show_message(tr("Reading the plans"))
        self.list.setFocus()

    def show_plans(self, plans: tuple[PlanSummary, ...]) -> None:
        self.list.clear()
        for plan in plans:
            remarks = tuple(map(kit.said, plan.remarks))
            where = tr("shipped with OCMM") if kit.is_shipped(plan.path) else str(plan.path)
            item = QListWidgetItem(
                tr("{name}, part {part}; {release}\n{where}").format(
                    name=plan.name, part=plan.part, release=", ".join(remarks), where=where
                ),
                self.list,
            )
            item.setData(_PATH, plan.path)
            item.setToolTip(kit.literal("\n".join((str(plan.path), *remarks))))
            item.setSizeHint(QSize(200, _PLAN_ROW_PX))
        self.show_message(tr("Return or F8 goes on with the selected plan."))
        if plans:
            self.list.setCurrentRow(0)
        self.list.setFocus()

    def _start(self) -> None:
        item = self.list.currentItem()
        if item is not None:
            path: Path = item.data(_PATH)
            self.chosen.emit(path)


def listed_jobs(folder: Path, recent: tuple[Path, ...]) -> tuple[LastJob, ...]:
    """Return the last jobs of the folder, and recent ones."""
    from ocmm_core.inspection.finished import last_jobs

    return last_jobs(folder, recent)


def listed_plans(recent: tuple[Path, ...], folder: Path | None) -> tuple[PlanSummary, ...]:
    """Return recent plans, those of the folder, and shipped ones."""
    from ocmm_core.inspection.plan import list_plans, plan_card

    found: dict[Path, PlanSummary] = {}
    for path in recent:
        with contextlib.suppress(OcmmError):
            found[path.absolute()] = plan_card(path)
    folders = [resource("plans")] if folder is None else [folder, resource("plans")]
    for place in folders:
        for card in list_plans(place):
            found.setdefault(card.path, card)
    return tuple(found.values())
