from __future__ import annotations

from PySide6.QtCore import QObject

from ocmm_core.inspection.evaluation import FeatureView, JobView
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre, ReasonPanel, tr
from ocmm_gui.operator._desk_view import DeskView


class PointChoice(QObject):
    """Select a point of the shown feature, delete or restore it."""

    def __init__(self, bridge: StationBridge, desk: DeskView, notices: NoticeCentre) -> None:
        super().__init__()
        self._bridge = bridge
        self._desk = desk
        self._notices = notices
        self._chosen = 0
        self.panel = ReasonPanel()
        self.panel.given.connect(self._delete)
        desk.feature.point_chosen.connect(self.choose)

    @property
    def chosen(self) -> int:
        """Return the selected point; zero for none."""
        return self._chosen

    def choose(self, number: int) -> None:
        """Mark a point; zero marks none."""
        self._chosen = number
        self._desk.feature.choose(number)
        self._desk.points.choose(number)

    def step(self, way: int) -> None:
        """Select the next or previous point of the shown feature; outliers first."""
        feature = self._feature()
        if feature is None or not feature.points:
            self._notices.inform(tr("No points to select yet."))
            return
        numbers = [point.number for point in feature.points]
        if self._chosen in numbers:
            self.choose(numbers[(numbers.index(self._chosen) + way) % len(numbers)])
        else:
            self.choose((*feature.outliers, numbers[-1])[0])

    def delete(self) -> None:
        feature = self._feature()
        if self._chosen:
            self.panel.ask(self._chosen)
        elif feature is not None and feature.commanding is not None:
            self._bridge.choice.remove_commanding(feature.name)
        else:
            self._notices.inform(tr("Select a point first: press . or , or click its bar."))

    def restore(self) -> None:
        """Restore the last deleted point of the shown feature."""
        feature = self._feature()
        if feature is None or not feature.deleted:
            self._notices.inform(tr("No deleted points on this feature."))
            return
        self._bridge.choice.restore_point(feature.deleted[-1].point.number)

    def show_job(self, job: JobView) -> None:
        """Clear the selection if its point is gone or another feature is shown."""
        feature = job.shown
        known = () if feature is None else [point.number for point in feature.points]
        if self._chosen and self._chosen not in known:
            self.choose(0)

    def _feature(self) -> FeatureView | None:
        return self._bridge.shown.job.shown

    def _delete(self, number: int, reason: str) -> None:
        self._bridge.choice.delete_point(number, reason)
        self._desk.setFocus()
