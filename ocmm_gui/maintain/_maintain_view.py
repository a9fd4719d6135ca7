"""Maintain mode: a list of pages, the selected page, the machine's status, irreversible actions.

Irreversible actions need their key pressed twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSize
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QListWidget, QListWidgetItem, QStackedWidget, QWidget

from ocmm_core.inspection.evaluation import LiveView
from ocmm_gui import kit
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import tr
from ocmm_gui.maintain._probe_page import ProbePage

_SIDE_PX = 170
_ROW_PX = 48
_LARGE_PX = 54
_TOOLS = ("start", "settings", "theme", "log")


@dataclass(frozen=True, slots=True)
class Page:
    title: str
    tip: str
    widget: QWidget
    actions: tuple[str, ...] = ()
    """Keys of its actions; each gets a button."""


class MaintainView(QWidget):
    """Pages with a list; up and down select."""

    def __init__(self, pages: Sequence[Page], actions: Mapping[str, QAction]) -> None:
        super().__init__()
        self.status = kit.FitText(tr("Status"), limit=26, reserve=tr("INACCURATE"), high=40)
        self.list = kit.dressed(
            QListWidget(), tr("Pages"), tr("Up and down select a page"),
            font=kit.text_font(18, bold=True),
        )  # fmt: skip
        self.list.setItemDelegate(kit.NarrowItems(self.list))
        self._stack = QStackedWidget()
        self._pages = tuple(page.widget for page in pages)
        for page in pages:
            item = QListWidgetItem(page.title, self.list)
            item.setToolTip(kit.literal(page.tip))
            item.setSizeHint(QSize(_SIDE_PX - 20, _ROW_PX))
            self._stack.addWidget(self._with_buttons(page, actions))
        self.list.currentRowChanged.connect(self._stack.setCurrentIndex)
        self.list.setCurrentRow(0)
        self.list.setFixedHeight(_ROW_PX * len(pages) + 4)
        heading = kit.dressed(kit.PlainLabel(tr("Maintain")), font=kit.text_font(20, bold=True))
        back = kit.make_button(actions["mode"])
        kit.dressed(back, tr("Inspect"), font=kit.text_font(16, bold=True), high=52)
        back.setText(tr("Inspect  [M]"))
        back.setObjectName("back")
        side = kit.vbox(heading, self.status, self.list, 1, back, spacing=6)
        kit.hbox(side, (self._stack, 1), parent=self, spacing=10, margins=(10, 8, 10, 8))
        for widget in (heading, self.status, self.list, back):
            widget.setFixedWidth(_SIDE_PX)

    def page(self) -> QWidget:
        return self._pages[max(self.list.currentRow(), 0)]

    def show_page(self, page: QWidget) -> None:
        self.list.setCurrentRow(self._pages.index(page))

    def show_live(self, live: LiveView) -> None:
        self.status.show_status(live.status)
        self.status.setToolTip(kit.literal(kit.said(live.reason)))

    @staticmethod
    def _with_buttons(page: Page, actions: Mapping[str, QAction]) -> QWidget:
        whole = QWidget()
        layout = kit.vbox((page.widget, 1), parent=whole, spacing=8, margins=0)
        if page.actions:
            layout.addLayout(_large_buttons([actions[key] for key in page.actions]))
        hint = kit.dressed(kit.PlainLabel(page.tip), font=kit.text_font(12), role="muted")
        tools = (
            kit.dressed(kit.make_button(actions[key]), font=kit.text_font(13)) for key in _TOOLS
        )
        layout.addLayout(kit.hbox((hint, 1), *tools, spacing=6))
        return whole


def _large_buttons(actions: Sequence[QAction]) -> QHBoxLayout:
    """Return buttons for gloved hands, as wide as possible."""
    row = kit.hbox(spacing=6)
    for action in actions:
        button = kit.make_button(action, primary=True)
        kit.dressed(button, font=kit.text_font(15), high=_LARGE_PX)
        button.setText(button.text().replace("  [", "\n["))
        row.addWidget(button, 1)
    return row


TWICE_S = 8.0
"""Time limit of the second press."""


class ConfirmedActions:
    """Write intrinsics to the cameras, and record a tip change."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: kit.NoticeCentre,
        probe: ProbePage,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._bridge = bridge
        self._notices = notices
        self._probe = probe
        self._clock = clock
        self._asked = ("", -float("inf"))

    def write_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras."""
        asked = tr(
            "This overwrites the intrinsics stored in the cameras with those of the active "
            "calibration. Press W again to confirm."
        )
        if self._is_meant("cameras", asked):
            self._bridge.maintenance.write_to_cameras()

    def mount_tip(self) -> None:
        tip = self._probe.tips.chosen()
        if tip is None:
            self._notices.inform(tr("No tip calibrated yet: calibrate the probe with this tip."))
            return
        asked = tr(
            "Confirm that tip '{tip}' is now mounted? It must be checked before points "
            "are taken. Press N again to confirm."
        ).format(tip=tip)
        if self._is_meant(tr("tip {tip}").format(tip=tip), asked):
            self._bridge.maintenance.mount_tip(tip)
            self._probe.forget()

    def _is_meant(self, what: str, asked: str) -> bool:
        """Return whether the same was requested a moment before; otherwise request it."""
        now = self._clock()
        before, when = self._asked
        if before == what and now - when <= TWICE_S:
            self._asked = ("", -float("inf"))
            return True
        self._asked = (what, now)
        self._notices.inform(asked)
        return False
