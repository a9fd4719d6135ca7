"""Preview of a report's first page by the settings, drawn in another process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QFileSystemWatcher, QSize, Qt, QTimer
from PySide6.QtGui import QImage, QPixmap, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.settings import Settings
from ocmm_gui.kit import PlainLabel, later, said, sentence_label, tr, use_role
from ocmm_gui.work import SideProcess, Teller

_LEAST_PX, _MOST_PX = 300, 1240
_A4 = 297.0 / 210.0
_SETTLE_MS = 300
"""Debounce of window resizing and of editors that write in pieces."""
_SAME_PX = 8


@dataclass(frozen=True, slots=True)
class HeadPage:
    """Draw the first page of an empty report. Imports happen in the drawing process only."""

    settings: Settings
    width: int

    def __call__(self, tell: Teller) -> tuple[int, int, bytes]:
        """Return width, height and pixels (``QImage.Format_RGB32``); errors as `use_head`."""
        from ocmm_gui.reports import template_page

        tell(later("Drawing the first page"), 0.5)
        page = template_page(self.settings, self.width)
        return page.width, page.height, page.content


class TemplatePreview(QWidget):
    """The page, or the error in the template: file, line, field, and remedy."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Preview of the report template"))
        self.words = sentence_label(tr("State of the preview"), 14)
        self.page = PlainLabel()
        self.page.setAccessibleName(tr("First page of a report"))
        self.page.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        self.page.setMinimumSize(QSize(1, 1))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.words)
        layout.addWidget(self.page, 1)
        self.setMinimumWidth(_LEAST_PX)
        self._settings: Settings | None = None
        self._width = 0
        self._work = SideProcess(self)
        self._work.finished.connect(self._show)
        self._work.failed.connect(self._fail)
        self._settling = QTimer(self)
        self._settling.setSingleShot(True)
        self._settling.setInterval(_SETTLE_MS)
        self._settling.timeout.connect(self._draw)
        # Templates are edited with other programs.
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(lambda _path: self._settling.start())

    def follow(self, settings: Settings) -> None:
        """Show the page for settings, and again after changes of their template."""
        self._settings = settings
        self._settling.start()

    def is_drawing(self) -> bool:
        return self._settling.isActive() or self._work.is_running()

    def close_work(self) -> None:
        self._settling.stop()
        self._work.cancel()

    def showEvent(self, event: QShowEvent) -> None:
        """Draw changes made while hidden."""
        super().showEvent(event)
        if self._settings is not None:
            self._settling.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self._width and abs(self._room() - self._width) > _SAME_PX:
            self._settling.start()

    def _room(self) -> int:
        high = int(self.page.height() / _A4)
        return min(max(min(self.width(), high), _LEAST_PX), _MOST_PX)

    def _draw(self) -> None:
        if self._settings is None or not self.isVisible():
            return
        self._watch(self._settings.report_template)
        self._width = self._room()
        use_role(self.words, "muted")
        self.words.setText(tr("Drawing the first page"))
        self._work.start(HeadPage(self._settings, self._width))

    def _watch(self, template: Path | None) -> None:
        # Replacing a file ends its watch.
        wanted = [] if template is None else [str(template.absolute())]
        old = self._watcher.files()
        if old != wanted:
            if old:
                self._watcher.removePaths(old)
            if wanted and Path(wanted[0]).exists():
                self._watcher.addPaths(wanted)

    def _show(self, answer: object) -> None:
        if isinstance(answer, tuple):
            width, height, content = answer
            image = QImage(content, width, height, QImage.Format.Format_RGB32)
            self.page.setPixmap(QPixmap.fromImage(image))
            self.words.setText(
                tr("First page of a report, nothing measured. It follows the settings.")
            )

    def _fail(self, error: object) -> None:
        if isinstance(error, OcmmError):
            # The previous page would be mistaken for this template's.
            self.page.clear()
            use_role(self.words, "warn")
            self.words.setText("▲ " + said(f"{error.what} {error.remedy}"))
