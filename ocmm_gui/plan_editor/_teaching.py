"""Nominals from the part of a job file, computed in a side process."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QProgressBar

from ocmm_core.inspection.archive import reopen_job
from ocmm_core.inspection.evaluation import checked_features
from ocmm_core.inspection.plan import Plan, taught_plan
from ocmm_core.measuring import reported_points
from ocmm_gui.kit import later, tr
from ocmm_gui.work import SideProcess, Tell


class Teaching(QProgressBar):
    """Progress of teaching; hidden otherwise."""

    taught = Signal(object)
    """Emits the `Plan` with its new nominals."""
    failed = Signal(object)
    """Emits an `OcmmError`."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Progress of teaching"))
        self.hide()
        self._process = SideProcess(self)
        self._process.finished.connect(self._on_finished)
        self._process.failed.connect(self._on_failed)
        self._process.advanced.connect(self._on_advanced)

    def toggle(self, job: Path, plan: Plan) -> None:
        """Start with the part of a job, or cancel."""
        if self._process.is_running():
            self.cancel()
            return
        self.setValue(0)
        self.show()
        self._process.start(partial(taught_of_file, job, plan))

    def cancel(self) -> None:
        self._process.cancel()
        self.hide()

    def _on_finished(self, found: object) -> None:
        self.hide()
        self.taught.emit(found)

    def _on_failed(self, error: object) -> None:
        self.hide()
        self.failed.emit(error)

    def _on_advanced(self, what: str, share: float) -> None:
        self.setFormat(what)
        self.setValue(round(100.0 * share))


def taught_of_file(path: Path, plan: Plan, tell: Tell) -> Plan:
    """Return a plan with nominals measured in a job, in its part frame; or raise OcmmError."""
    tell(later("Reading the job"), 0.2)
    job = reopen_job(path)
    tell(later("Rounding the nominals"), 0.8)
    points = reported_points(job.points, job.climate.part)
    actual = checked_features(job.plan, points, job.options)
    return taught_plan(plan, actual, job.T_part_from_world)
