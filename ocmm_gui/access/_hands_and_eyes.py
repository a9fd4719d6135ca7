"""Zoom and gloves of one window, by its keys and settings."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QApplication, QMainWindow

from ocmm_core.errors import OcmmError
from ocmm_core.settings import Settings, SettingsStore, Value
from ocmm_gui.access._screen import screen_size
from ocmm_gui.access._touch import TouchTargets
from ocmm_gui.access._zoom import LEAST_PERCENT, MOST_PERCENT, STEP_PERCENT, Zoom
from ocmm_gui.access._zoom_area import ZoomArea
from ocmm_gui.kit import NoticeCentre, tr


class HandsAndEyes(QObject):
    """Zoom of a window with central widget ``area``, and targets for gloves; both are stored."""

    kept = Signal()
    """A key changed a setting: displayed settings must be reread."""

    def __init__(
        self, window: QMainWindow, area: ZoomArea, store: SettingsStore, notices: NoticeCentre
    ) -> None:
        super().__init__(window)
        self._window, self._area = window, area
        self._store, self._notices = store, notices
        app = QApplication.instance()
        assert isinstance(app, QApplication)  # noqa: S101 - a window has one
        found = app.findChild(Zoom)
        self.zoom = found if isinstance(found, Zoom) else Zoom(app)
        self.touch = TouchTargets(window)
        self._settings: Settings | None = None
        self._far = False
        # The minimum size was given in unscaled pixels.
        window.setMinimumSize(window.minimumSize() / self.zoom.factor())
        self.zoom.changed.connect(self._fit)

    def calls(self) -> dict[str, Callable[[], None]]:
        return {
            "zoom_in": lambda: self.step(1),
            "zoom_out": lambda: self.step(-1),
            "zoom_reset": lambda: self._keep_zoom(100),
            "gloves": self.toggle_gloves,
        }

    def use(self, settings: Settings) -> None:
        self._settings = settings
        self.zoom.use(settings.window_zoom, self._window.screen())
        self._fit()

    def show_far(self, far: bool) -> None:
        """Keep the far view as large as the window; other pages may be scrolled."""
        self._far = far
        self._area.use(enlarged=self.zoom.percent > 100, far=far)
        self.touch.fit()

    def step(self, steps: int) -> None:
        """Enlarge, or reduce with negative ``steps``."""
        now = self.zoom.percent + STEP_PERCENT * steps
        self._keep_zoom(min(max(now, LEAST_PERCENT), MOST_PERCENT))

    def toggle_gloves(self) -> None:
        on = self._settings is None or not self._settings.window_gloves
        self._keep({"window.gloves": on})
        if not on:
            self._notices.inform(tr("Glove mode off."))
        elif self._size_is_known():
            self._notices.inform(tr("Glove mode on: targets of 15 mm."))
        else:
            self._notices.warn(
                tr("Glove mode on, but this screen does not tell its size."),
                tr("Measure the line in Settings, Window: then targets are 15 mm."),
            )

    def _size_is_known(self) -> bool:
        ruler = None if self._settings is None else self._settings.window_ruler_mm
        return screen_size(self._window.screen(), ruler).known

    def _keep_zoom(self, percent: int) -> None:
        self._keep({"window.zoom": percent})
        shown = tr("Zoom {percent} %.").format(percent=percent)
        if not self.zoom.can_change():
            shown += " " + tr("It is used from the next start.")
        self._notices.inform(shown)

    def _keep(self, changes: dict[str, Value]) -> None:
        # If it cannot be stored it holds until restart, without a message.
        with contextlib.suppress(OcmmError):
            self._store.change(changes)
        chosen: dict[str, Any] = {key.replace(".", "_"): new for key, new in changes.items()}
        self.use(replace(self._store.load().settings, **chosen))
        self.kept.emit()

    def _fit(self) -> None:
        settings = self._settings
        self._area.use(enlarged=self.zoom.percent > 100, far=self._far)
        if settings is None or not settings.window_gloves:
            self.touch.use(None)
        else:
            size = screen_size(self._window.screen(), settings.window_ruler_mm)
            self.touch.use(size.mm_per_px)
        self._area.use_bars(self.touch.pixels())
