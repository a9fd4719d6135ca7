"""What pages have in common while both hands are on the probe."""

from __future__ import annotations

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from ocmm_core.calibration.procedure import Live
from ocmm_core.camera.rig import Rig
from ocmm_gui.maintain.parts import panel
from ocmm_gui.wizards.far_banner import FarBanner
from ocmm_gui.wizards.live_panel import CameraRow
from ocmm_gui.wizards.pages import StepPage
from ocmm_gui.wizards.sphere_map import SphereMap

_SIDE_PX = 360


class HandsPage(StepPage):
    """A banner to be read from afar, a map below it, scores and cameras at the right.

    Everything is taken by itself, and the next step is entered by itself.

    Parameters
    ----------
    rig
        What the session starts from.
    told, mapped
        What banner and map tell.
    """

    hands_are_full = True
    goes_on_by_itself = True

    def __init__(self, rig: Rig, told: str, mapped: str) -> None:
        super().__init__()
        self.banner = FarBanner(told)
        self.map = SphereMap(mapped, rig)
        self.cameras = CameraRow(rig)
        self.scores = QVBoxLayout()
        self.scores.setSpacing(6)
        side = QVBoxLayout()
        side.setContentsMargins(0, 0, 0, 0)
        side.setSpacing(8)
        side.addWidget(panel(self.scores), 5)
        row = QVBoxLayout()
        row.addWidget(self.cameras)
        side.addWidget(panel(row), 3)
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
        layout.addWidget(self.banner, 2)
        layout.addLayout(self.beside, 5)

    def show_cameras(self, live: Live) -> None:
        """Show what the cameras see."""
        self.cameras.show_cameras(live.cameras)
