"""The current page of the window, and the keys it leaves to the window."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

from ocmm_gui.access import PageStack
from ocmm_gui.kit import ACTIONS, Banner, Mode, Sheet, show_mode, tr
from ocmm_gui.operator import DeskView, FarView
from ocmm_gui.window._acceptance import AcceptanceRooms
from ocmm_gui.window._maintenance import Maintenance
from ocmm_gui.window._sheets import Sheets

_IN_WIZARDS = ("theme", "log", "manual", "zoom_in", "zoom_out", "zoom_reset", "gloves")
"""Actions of the window that remain in a wizard."""
_ON_SHEETS = (*_IN_WIZARDS, "settings", "start", "find", "what_to_do", "support")
"""The same for a sheet, which can be left without loss."""


class Pages(QObject):
    """The far view and the desk view, the sheets, Maintain with its wizards: one is shown."""

    mode_wanted = Signal()
    """Inspect or Maintain is about to be shown: file panels close."""
    turned = Signal()
    """Another, still empty page is shown."""

    def __init__(
        self,
        desk: DeskView,
        far: FarView,
        sheets: Sheets,
        maintenance: Maintenance,
        tests: AcceptanceRooms,
        actions: Mapping[str, QAction],
        banner: Banner,
    ) -> None:
        super().__init__()
        self.stack = PageStack()
        self._desk, self._far = desk, far
        self._inspect: QWidget = desk
        self._sheets, self._maintenance, self._tests = sheets, maintenance, tests
        self._actions, self._banner = actions, banner
        for view in (desk, far):
            self.stack.addWidget(view)
        # Methods, which Qt references weakly: a lambda would keep the window forever.
        sheets.wanted.connect(self.leave_keys_to)
        sheets.left.connect(self._to_inspect)
        sheets.left_manual.connect(self._leave_manual)
        sheets.left_to_maintain.connect(self._to_maintain)
        maintenance.wanted.connect(self.leave_keys_to)
        maintenance.left.connect(self._to_maintain)

    def shown(self) -> QWidget | None:
        return self.stack.currentWidget()

    def mode(self) -> Mode:
        shown = self.shown()
        inspects = shown in (self._desk, self._far) or self._sheets.holds(shown)
        return Mode.INSPECT if inspects else Mode.MAINTAIN

    def is_far(self) -> bool:
        return self.shown() is self._far

    def measures(self) -> bool:
        """Return whether one of the two views of the running job is shown."""
        return self.shown() in (self._desk, self._far)

    def practises(self) -> bool:
        """Return whether a guided page with the virtual hand is shown."""
        shown = self.shown()
        guided = (self._maintenance.is_made("wizard") and shown is self._maintenance.wizard) or (
            self._tests.is_made("desk") and shown is self._tests.desk
        )
        return guided and self._maintenance.practises

    def name(self) -> str:
        """Return 'desk', 'far' or 'other'."""
        shown = self.shown()
        return "desk" if shown is self._desk else "far" if shown is self._far else "other"

    def show_mode(self, mode: Mode) -> None:
        maintain = mode is Mode.MAINTAIN
        show_mode(self._actions, mode)
        self.mode_wanted.emit()
        self._actions["mode"].setText(tr((Mode.INSPECT if maintain else Mode.MAINTAIN).value))
        if not maintain:
            self.show_far(self._inspect is self._far)
            return
        self.stack.setCurrentWidget(self._maintenance.view)
        self._banner.use_far(far=False)
        self.turned.emit()
        self._maintenance.view.list.setFocus()

    def other_mode(self) -> None:
        self.show_mode(Mode.INSPECT if self.mode() is Mode.MAINTAIN else Mode.MAINTAIN)

    def show_far(self, far: bool) -> None:
        self._inspect = self._far if far else self._desk
        self.stack.setCurrentWidget(self._inspect)
        self._banner.use_far(far=far)
        self._actions["view"].setText(tr("Desk view") if far else tr("Far view"))
        self.turned.emit()
        self._inspect.setFocus()

    def to_desk(self) -> None:
        self.show_mode(Mode.INSPECT)
        self.show_far(False)

    def leave_keys_to(self, view: QWidget) -> None:
        """Show a sheet or a wizard, which has its own keys."""
        kept = _ON_SHEETS if self._is_free(view) else _IN_WIZARDS
        for info in ACTIONS:
            self._actions[info.key].setEnabled(info.key in kept)
        self.stack.setCurrentWidget(view)
        self._banner.use_far(far=False)

    def focus(self) -> None:
        page = self.shown()
        if page is not None:
            page.setFocus()

    def keys(self) -> dict[str, QAction]:
        page = self.shown()
        own = page.keys if isinstance(page, Sheet) else {}
        return {**own, **self._actions}

    def others(self) -> dict[str, QAction]:
        """Return the actions of the window that belong to another page.

        A wizard is not left for them, and a pedal acts only on its visible page.
        """
        on_sheet = self._sheets.holds(self.shown())
        if not self.may_be_left():
            return {}
        return {
            info.key: self._actions[info.key]
            for info in ACTIONS
            if info.mode is not None
            and not info.is_trigger
            and (on_sheet or info.mode is not self.mode())
        }

    def may_be_left(self) -> bool:
        """Return whether the page may be left: a wizard has its own end."""
        return self._is_free(self.shown())

    def _is_free(self, page: QWidget | None) -> bool:
        if self._sheets.is_made("manual") and page is self._sheets.manual:
            # The manual returns to its origin, which may be a wizard.
            page = self._sheets.manual.came_from()[0] or self._desk
        measures = page in (self._desk, self._far)
        return measures or self._sheets.holds(page) or self._is_maintenance(page)

    def do_elsewhere(self, key: str) -> None:
        """Do an action of another page there."""
        mode = next(info.mode for info in ACTIONS if info.key == key)
        if mode is not None:
            self.show_mode(mode)
        self._actions[key].trigger()

    def _is_maintenance(self, shown: QWidget | None) -> bool:
        return self._maintenance.is_made("view") and shown is self._maintenance.view

    def _to_inspect(self) -> None:
        self.show_mode(Mode.INSPECT)

    def _to_maintain(self) -> None:
        self.show_mode(Mode.MAINTAIN)

    def _leave_manual(self) -> None:
        """Restore the former page and its focus."""
        page, focus = self._sheets.manual.came_from()
        if page is None or page in (self._desk, self._far):
            self.show_mode(Mode.INSPECT)
        elif self._is_maintenance(page):
            self.show_mode(Mode.MAINTAIN)
        else:
            self.leave_keys_to(page)
            page.setFocus()
        if focus is not None and focus.isVisible():
            focus.setFocus()
