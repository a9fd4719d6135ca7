"""Common base of pages while both hands hold the probe."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from ocmm_core.calibration.guided import Live
from ocmm_core.camera import Rig
from ocmm_core.tracking import ProbeBody
from ocmm_gui.charts import SphereMap
from ocmm_gui.kit import panel, tr
from ocmm_gui.wizards.parts._facts import Facts
from ocmm_gui.wizards.parts._far_banner import FarBanner
from ocmm_gui.wizards.parts._live_panel import CameraRow
from ocmm_gui.wizards.parts._pages import StepPage
from ocmm_gui.wizards.parts._prepare_page import session_facts
from ocmm_gui.wizards.parts._probe_picture import ProbePicture
from ocmm_gui.wizards.parts._shown import Seen

_SIDE_PX = 360


class ProbePreparePage(StepPage):
    """Fixed facts of a probe session, next to a picture of the probe."""

    def __init__(self, design: ProbeBody, facts: Sequence[tuple[str, str]]) -> None:
        super().__init__()
        self._about = tuple(facts)
        self.picture = ProbePicture()
        self.picture.show_probe(design.leds_probe, design.led_directions_probe, design.tip_probe)
        self.facts = Facts(tr("The session"))
        column = QVBoxLayout()
        column.addWidget(self.facts)
        column.addStretch(1)
        side = panel(column)
        side.setFixedWidth(_SIDE_PX)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.picture, 1)
        layout.addWidget(side)

    def show_seen(self, seen: Seen) -> None:
        base = seen.view.base
        self.facts.show_facts((*self._about, *session_facts(base)))


class HandsPage(StepPage):
    """A banner readable from afar, a map below, scores and cameras at the right.

    Observations and steps proceed automatically.
    """

    hands_are_full = True
    goes_on_by_itself = True

    def __init__(self, rig: Rig, told: str, mapped: str) -> None:
        super().__init__()
        self.banner = FarBanner(told)
        self.map = SphereMap(mapped, rig)
        self.cameras = CameraRow(rig)
        self.scores = QVBoxLayout()
        self.scores.setSpacing(4)
        side = QVBoxLayout()
        side.setContentsMargins(0, 0, 0, 0)
        side.setSpacing(8)
        side.addWidget(panel(self.scores), 3)
        row = QVBoxLayout()
        row.addWidget(self.cameras)
        side.addWidget(panel(row), 1)
        holder = QWidget()
        holder.setLayout(side)
        holder.setFixedWidth(_SIDE_PX)
        self.beside = QHBoxLayout()
        self.beside.setSpacing(8)
        self.beside.addWidget(self.map, 1)
        self.beside.addWidget(holder)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.banner, 3)
        layout.addLayout(self.beside, 5)

    def show_cameras(self, live: Live) -> None:
        self.cameras.show_cameras(live.cameras)
