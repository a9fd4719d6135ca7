"""Desk view: part, plan, feature and status, and the camera line with a button for images."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QStyle,
    QWidget,
)

from ocmm_core.camera import Rig
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView, LiveView
from ocmm_core.inspection.plan import Plan
from ocmm_core.tracking import ProbeBody
from ocmm_gui import kit
from ocmm_gui.bridge import StationBridge
from ocmm_gui.help import CoachPanel
from ocmm_gui.kit import tr
from ocmm_gui.operator._feature_panel import FeaturePanel
from ocmm_gui.operator._readout import CoachedView, Readout
from ocmm_gui.operator._status_strip import Guidance, StatusStrip
from ocmm_gui.operator._view_parts import FeatureList, PartVerdictView
from ocmm_gui.views import CameraViews, PointView, StepPicture

_MOST_NAMED = 4
"""With more cameras only the blind ones are named."""


class CameraBar(QFrame):
    """Spot counts; blind cameras do not open images, which would cover the part."""

    def __init__(self, rig: Rig, action: QAction) -> None:
        super().__init__()
        self._names = tuple(camera.name for camera in rig.cameras)
        self.words = kit.dressed(
            kit.PlainLabel(), tr("Cameras"), font=kit.text_font(13), role="muted"
        )
        # Too long for the line with many cameras.
        self.words.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        button = kit.dressed(kit.make_button(action), font=kit.text_font(12), role="tool")
        kit.hbox((self.words, 1), button, parent=self, spacing=8, margins=(4, 0, 0, 0))

    def show_live(self, live: LiveView) -> None:
        counts = np.isfinite(live.spots).all(axis=2).sum(axis=1).tolist()
        # Without frames no camera is blind: the line must not mislead.
        silent = not any(counts) and not live.frames_per_second
        words = kit.said(live.reason) if silent else _camera_words(self._names, counts)
        if self.words.text() != words:
            self.words.setText(words)
            self.words.setToolTip(kit.literal(words))


def _camera_words(names: tuple[str, ...], counts: list[int]) -> str:
    """Return the blind cameras, or the spot counts of all."""
    seen = list(zip(names, counts, strict=True))
    blind = [name for name, count in seen if not count]
    if blind:
        return tr("Camera sees no LED: {names}").format(names=", ".join(blind))
    if len(seen) <= _MOST_NAMED:
        return "   ".join(
            tr("{name}: %n spots", "{name}: 1 spot", count).format(name=name)
            for name, count in seen
        )
    return tr(
        "{count} cameras, at least %n spots each",
        "{count} cameras, at least 1 spot each",
        min(counts),
    ).format(count=len(seen))


_PAGES = ("start", "job", "plan", "alignment", "results", "manual")
_TOOLS = ("part_mode", "fit", "closeup", "export", "view", "mode")
_STEPS = (("flip", "skip", "repeat"), ("order", "side", "pause"), ("reopen",))
_PART_PX = 190
_TOUCHED_PX = 57
"""15 mm at 96 dpi: a gloved finger."""
_PICTURE_PX = (96, 190)
"""Minimum and maximum height of the step picture."""
_SIDE_PX = 250
_PANEL_PX = 410
_PANEL_SHARE = 0.214
"""Minimum width of the panel, and share of a wide screen: its digits grow with it."""
_READOUT_SHARE = 70
"""In hundredths; the coach, read from near, has the rest."""


class DeskView(CoachedView):
    """Complete view for the technician."""

    def __init__(self, rig: Rig, body: ProbeBody, actions: dict[str, QAction]) -> None:
        super().__init__()
        self.strip = StatusStrip(len(rig.cameras), body.n_leds)
        self.plan = FeatureList()
        self.points = PointView(rig, body, animated=_animated())
        self.readout = Readout()
        self.coach = CoachPanel()
        self.coach.refusal_over.connect(self.forget_refusal)
        self.feature = FeaturePanel()
        self.guidance = Guidance(15)
        self.picture = StepPicture()
        self._part_mode = actions["part_mode"]
        self._part_mode.setEnabled(False)
        self._nominals: Mapping[str, NominalFeature] = {}
        self._folder: Path | None = None
        self.cameras = CameraViews(rig)
        # The part has priority; a key or the bar opens the cameras.
        self.cameras.hide()
        self.camera_bar = CameraBar(rig, actions["cameras"])
        # Too long for one line with hundreds of features.
        self._heading = kit.sentence_label(tr("Job"), 14, middle=True)
        self._heading.setFont(kit.text_font(14, bold=True))
        self._header = kit.sentence_label(tr("Operator and part"), 12, role="muted")
        self._climate = kit.sentence_label(tr("Temperatures"), 12, role="muted")
        self.part = PartVerdictView(limit=92, least=15)
        self.part.setFixedHeight(_PART_PX)
        self.part.hide()
        # Below the picture: next to it the digits need the height.
        centre = kit.vbox(self.part, (self.points, 1), self._guided(), spacing=8)
        work = QWidget()
        kit.hbox(self._left(actions), (centre, 1), parent=work, spacing=8, margins=0)
        self._split = QSplitter(Qt.Orientation.Vertical)
        self._split.setChildrenCollapsible(False)
        self._split.addWidget(work)
        self._split.addWidget(self.cameras)
        self._split.setStretchFactor(0, 3)
        self._split.setStretchFactor(1, 1)
        self._split.setSizes([690, 230])
        left = kit.vbox((self._split, 1), self.camera_bar, spacing=4)
        self._side = self._right(actions)
        middle = kit.hbox((left, 1), self._side, spacing=8)
        kit.vbox(
            self.strip, (middle, 1), _tool_row(actions), parent=self, spacing=8,
            margins=(10, 8, 10, 8),
        )  # fmt: skip

    def use_plan(self, plan: Plan, folder: Path | None) -> None:
        """Set the plan; ``folder`` has its pictures."""
        self._nominals = {feature.name: feature for feature in plan.features}
        self._folder = folder

    def show_live(self, live: LiveView) -> None:
        self.strip.show_live(live)
        self.readout.show_live(live)
        self.guidance.show_live(live)
        self.points.show_live(live)
        self.camera_bar.show_live(live)
        if self.cameras.isVisible():
            self.cameras.show_live(live)

    def show_job(self, job: JobView) -> None:
        done = sum(feature.state is FeatureState.DONE for feature in job.features)
        self._heading.setText(
            tr(
                "{part}   {done} / %n features", "{part}   {done} / 1 feature", len(job.features)
            ).format(part=job.part, done=done)
        )
        self._heading.setToolTip(kit.literal(kit.header_words(job)))
        self._header.setText(kit.header_words(job))
        self.picture.show_step(self._nominals.get(job.active), self._folder)
        self._climate.setText(" ".join(map(kit.said, (job.temperature, *job.noise))).strip())
        self.strip.show_job(job)
        self.plan.show_job(job)
        self.part.show_job(job)
        self.part.setVisible(job.complete)
        self.points.show_job(job)
        self._part_mode.setEnabled(job.placed_part is not None)
        self.feature.show_job(job)
        self.guidance.show_job(job)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._side.setFixedWidth(max(_PANEL_PX, round(_PANEL_SHARE * self.width())))
        super().resizeEvent(event)

    def toggle_cameras(self) -> None:
        self.cameras.setVisible(self.cameras.isHidden())

    def _left(self, actions: dict[str, QAction]) -> QWidget:
        side = QWidget()
        side.setFixedWidth(_SIDE_PX)
        layout = kit.vbox(
            self._heading, self._header, (self.plan, 3), parent=side, spacing=6, margins=0
        )
        self.picture.setMinimumHeight(_PICTURE_PX[0])
        self.picture.setMaximumHeight(_PICTURE_PX[1])
        layout.addWidget(self.picture, 1)
        grid = QGridLayout()
        grid.setSpacing(4)
        for row, keys in enumerate(_STEPS):
            span = 3 // len(keys)
            for column, key in enumerate(keys):
                button = kit.make_button(actions[key])
                if len(actions[key].shortcuts()[0].toString()) > 1:
                    button.setText(actions[key].text())
                kit.dressed(button, font=kit.text_font(12), role="tool")
                grid.addWidget(button, row, span * column, 1, span)
        kit.fill(layout, grid, self._climate)
        return side

    def _guided(self) -> QWidget:
        box = QFrame()
        box.setProperty("role", "panel")
        kit.vbox(self.guidance, parent=box, margins=(12, 6, 12, 6))
        return box

    def _right(self, actions: dict[str, QAction]) -> QWidget:
        side = QWidget()
        layout = kit.vbox(parent=side, spacing=6, margins=0)
        above = kit.hbox(
            (self.readout, _READOUT_SHARE), (self.coach, 100 - _READOUT_SHARE), spacing=6
        )
        kit.fill(layout, (above, 2), (self.feature, 3))
        row = kit.hbox(spacing=8)
        for key in ("take", "undo", "finish"):
            button = kit.make_button(actions[key], primary=key == "take")
            kit.dressed(button, font=kit.text_font(18, bold=True), high=_TOUCHED_PX)
            button.setText(actions[key].text())
            row.addWidget(button, 1)
        layout.addLayout(row)
        return side


def _animated() -> bool:
    """Return whether the desktop permits animations."""
    hint = QStyle.StyleHint.SH_Widget_Animation_Duration
    return QApplication.style().styleHint(hint) > 0


def _tool_row(actions: dict[str, QAction]) -> QHBoxLayout:
    pages, tools = ([_tool(actions[key]) for key in keys] for keys in (_PAGES, _TOOLS))
    return kit.hbox(*pages, 1, *tools, spacing=5)


def _tool(action: QAction) -> QPushButton:
    button = kit.dressed(kit.make_button(action), font=kit.text_font(13), role="tool")
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button


class PointChoice(QObject):
    """Select a point of the shown feature, delete or restore it."""

    def __init__(self, bridge: StationBridge, desk: DeskView, notices: kit.NoticeCentre) -> None:
        super().__init__()
        self._bridge = bridge
        self._desk = desk
        self._notices = notices
        self.chosen = 0
        """Selected point; zero for none."""
        self.panel = kit.ReasonPanel()
        self.panel.given.connect(self._delete)
        desk.feature.point_chosen.connect(self.choose)

    def choose(self, number: int) -> None:
        """Mark a point; zero marks none."""
        self.chosen = number
        self._desk.feature.choose(number)
        self._desk.points.choose(number)

    def step(self, way: int) -> None:
        """Select the next or previous point of the shown feature; outliers first."""
        feature = self._feature()
        if feature is None or not feature.points:
            self._notices.inform(tr("No points to select yet."))
            return
        numbers = [point.number for point in feature.points]
        if self.chosen in numbers:
            self.choose(numbers[(numbers.index(self.chosen) + way) % len(numbers)])
        else:
            self.choose((*feature.outliers, numbers[-1])[0])

    def delete(self) -> None:
        feature = self._feature()
        if self.chosen:
            self.panel.ask(self.chosen)
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
        if self.chosen and self.chosen not in known:
            self.choose(0)

    def _feature(self) -> FeatureView | None:
        return self._bridge.shown.job.shown

    def _delete(self, number: int, reason: str) -> None:
        self._bridge.choice.delete_point(number, reason)
        self._desk.setFocus()
