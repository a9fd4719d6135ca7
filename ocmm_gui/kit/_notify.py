"""Notices: one log, one banner, and the hooks that feed them."""

from __future__ import annotations

import logging
import sys
import threading
import time
import traceback
from collections import deque
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QFrame, QMainWindow, QSizePolicy, QWidget

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.failure import contained
from ocmm_gui.kit._narrow import NarrowButton, PlainLabel
from ocmm_gui.kit._panels import dropped_file
from ocmm_gui.kit._parts import dressed, hbox
from ocmm_gui.kit._shortcuts import keeps_keys
from ocmm_gui.kit._texts import said, tr
from ocmm_gui.kit._theme import Themed, text_font

INFO_SECONDS = 12
_MOST_WAITING = 20
PROCEDURE = "procedure"
"""Job of notices about a wizard or a test."""
_AGAIN_S = 5.0
_FAR_SHARE, _DESK_PX = 26.0 / 1080.0, 14.0
"""Type size: relative to the window height, and in pixels."""


class Level(Enum):
    """Severity: value for the log; determines mark and colour of the banner."""

    INFO = "INFO"
    WARNING = "WARNING"
    ERROR = "ERROR"


_MARKS = {Level.INFO: "✔", Level.WARNING: "⚠", Level.ERROR: "✖"}
_COLOURS = {Level.INFO: "good", Level.WARNING: "warn", Level.ERROR: "bad"}


@dataclass(frozen=True, slots=True)
class Notice:
    """A message to the inspector."""

    level: Level
    """Information disappears automatically; warnings and errors stay until dismissed."""
    what: str
    remedy: str
    """`what`, `remedy`: event, and remedy (may be empty)."""
    detail: str
    """Full text for the log, such as a traceback; never on screen."""
    when: datetime
    job: str = ""
    """Job or procedure (`PROCEDURE`) whose end is that of its display; empty if about none."""


class NoticeCentre(QObject):
    """Store the last notices and notify listeners; `post` is thread-safe."""

    posted = Signal(object)
    ended = Signal(str)
    """Emits the job or procedure that has ended."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._notices: deque[Notice] = deque(maxlen=500)

    def post(self, notice: Notice) -> None:
        self._notices.append(notice)
        self.posted.emit(notice)

    def keep(self, notice: Notice) -> None:
        """Log a notice without showing it."""
        self._notices.append(notice)

    def kept(self) -> tuple[Notice, ...]:
        """Return the notices, oldest first."""
        return tuple(self._notices)

    def inform(self, what: str, job: str = "") -> None:
        """Show information, optionally about a job."""
        self.post(Notice(Level.INFO, what, "", "", datetime.now().astimezone(), job))

    def warn(self, what: str, remedy: str = "", job: str = "") -> None:
        self.post(Notice(Level.WARNING, what, remedy, "", datetime.now().astimezone(), job))

    def error(self, error: BaseException, job: str = "") -> None:
        """Show an error: `OcmmError` in its own words, others as `failure.contained`."""
        detail = "".join(traceback.format_exception(error))
        told = contained(error, "The window")
        when = datetime.now().astimezone()
        self.post(Notice(Level.ERROR, told.what, told.remedy, detail, when, job))

    def text(self) -> str:
        return "\n".join(
            f"{n.when.isoformat()} {n.level.value} {n.what} {n.remedy}\n{n.detail}"
            for n in list(self._notices)
        )

    def save(self, path: Path) -> None:
        """Write all stored notices with full text to a file; StorageError on failure."""
        text = self.text()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(path, (text or tr("No messages.\n")).encode())
        except OSError as error:
            raise StorageError(
                "log.write",
                f"The log cannot be written to {path} ({error.strerror}).",
                "Choose a folder that can be written in Settings (Jobs).",
            ) from error


class ErrorHooks(logging.Handler):
    """Feed a `NoticeCentre` while the context is open.

    Uncaught errors are shown; core log records from WARNING up are only kept for saving.
    """

    def __init__(self, centre: NoticeCentre) -> None:
        super().__init__(logging.WARNING)
        self._centre = centre
        self._previous = (sys.excepthook, threading.excepthook)
        self._told_at: dict[tuple[str, int], float] = {}

    def __enter__(self) -> ErrorHooks:
        self._previous = (sys.excepthook, threading.excepthook)
        sys.excepthook = self._on_error
        threading.excepthook = self._on_thread_error
        logging.getLogger().addHandler(self)
        return self

    def __exit__(self, *_: object) -> None:
        sys.excepthook, threading.excepthook = self._previous
        logging.getLogger().removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record of the core's log."""
        detail = "" if record.exc_info is None else self._traceback(record)
        when = datetime.fromtimestamp(record.created).astimezone()
        level = Level.ERROR if record.levelno >= logging.ERROR else Level.WARNING
        self._centre.keep(Notice(level, record.getMessage(), "", detail, when))

    @staticmethod
    def _traceback(record: logging.LogRecord) -> str:
        error = record.exc_info[1] if record.exc_info else None
        return "" if error is None else "".join(traceback.format_exception(error))

    def _on_error(
        self, kind: type[BaseException], error: BaseException, where: TracebackType | None
    ) -> None:
        if issubclass(kind, KeyboardInterrupt):
            self._previous[0](kind, error, where)
        elif self._is_news(error):
            self._centre.error(error)

    def _is_news(self, error: BaseException) -> bool:
        """Return whether a line of code fails for the first time in a while.

        Painting and polling errors recur thirty times a second.
        """
        trace = traceback.extract_tb(error.__traceback__)
        place = (trace[-1].filename, trace[-1].lineno or 0) if trace else ("", 0)
        now = time.monotonic()
        before, self._told_at[place] = self._told_at.get(place), now
        return before is None or now - before > _AGAIN_S

    def _on_thread_error(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None:
            self._centre.error(args.exc_value)


class Banner(Themed, QFrame):
    """The only display of notices; takes no focus and never blocks."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("banner")
        self.setAccessibleName(tr("Notice"))
        self._shown: list[Notice] = []
        self._job = ""
        self._text = dressed(PlainLabel(), tr("Notice text"))
        self._text.setWordWrap(True)
        self._far = False
        self._set_font()
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._dismiss = dressed(NarrowButton(""), tr("Dismiss this message"))
        self._dismiss.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._dismiss.clicked.connect(self.dismiss)
        hbox((self._text, 1), self._dismiss, parent=self, margins=(14, 6, 8, 6))
        self._timer = QTimer(self, singleShot=True, interval=INFO_SECONDS * 1000)
        self._timer.timeout.connect(self.dismiss)
        self.hide()

    def show_notice(self, notice: Notice) -> None:
        """Show a notice: the newest of the worst level; others wait until it is dismissed.

        Information replaces information; a text that repeats or continues another replaces it.
        """
        self._shown = [
            one
            for one in self._shown
            if one.level is not notice.level
            or not (notice.level is Level.INFO or notice.what.startswith(one.what))
        ]
        levels = list(Level)
        worse = [one for one in self._shown if levels.index(one.level) > levels.index(notice.level)]
        self._shown.insert(len(worse), notice)
        del self._shown[_MOST_WAITING:]
        self._show_first()
        if notice.level is Level.ERROR:
            # On a busy computer the rest of the window may take half a second to be painted.
            for widget in (self, self.parentWidget()):
                layout = None if widget is None else widget.layout()
                if layout is not None:
                    layout.invalidate()
                    layout.activate()
            self.repaint()

    def dismiss(self) -> bool:
        """Put away the shown notice and show the next; return whether one was shown."""
        was_shown = bool(self._shown)
        del self._shown[:1]
        self._show_first()
        return was_shown

    def end_job(self, job: str) -> None:
        """Put away the notices about other jobs than ``job``; later ones about them expire."""
        self._job = job
        self._shown = [one for one in self._shown if one.job in ("", PROCEDURE, job)]
        self._show_first()

    def end(self, job: str) -> None:
        """Put away the notices about ``job``."""
        self._shown = [one for one in self._shown if one.job != job]
        self._show_first()

    def keeps_esc(self) -> bool:
        """Return whether Esc dismisses the notice before it leaves a page.

        Information ends by itself and does not keep Esc from the page.
        """
        return bool(self._shown) and self._shown[0].level is not Level.INFO

    def _show_first(self) -> None:
        self._timer.stop()
        self.setVisible(bool(self._shown))
        if not self._shown:
            return
        notice, waiting = self._shown[0], len(self._shown) - 1
        self._text.setText(
            f"{_MARKS[notice.level]}  {said(notice.what)} {said(notice.remedy)}".rstrip()
        )
        word = tr("Dismiss") if notice.level is Level.INFO else tr("Dismiss  [Esc]")
        more = tr("{word}  ({count} more)").format(word=word, count=waiting)
        self._dismiss.setText(more if waiting else word)
        self._set_font()
        self._paint()
        if notice.level is Level.INFO or notice.job not in ("", PROCEDURE, self._job):
            self._timer.start()

    def use_far(self, *, far: bool) -> None:
        """Set the type for far or near reading."""
        self._far = far
        self._set_font()

    def text(self) -> str:
        return self._text.text()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._set_font()

    def _set_font(self) -> None:
        pixels = max(_FAR_SHARE * self.window().height(), _DESK_PX) if self._far else _DESK_PX
        self._text.setFont(text_font(pixels, bold=True))

    def _paint(self) -> None:
        if self._shown:
            colour = self._theme.colour(_COLOURS[self._shown[0].level])
            self.setStyleSheet(
                f"#banner {{ background: {self._theme.panel}; border: 2px solid {colour};"
                f" border-radius: 6px; }} QLabel {{ color: {colour}; }}"
            )


class NoticeWindow(QMainWindow):
    """A window that takes dropped files, with a banner, which Esc dismisses before a page."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumSize(1024, 640)
        self.setAcceptDrops(True)
        self.banner = Banner()

    def take_file(self, path: Path) -> None:
        """Open a plan or a job."""
        raise NotImplementedError

    def may_take_files(self) -> bool:
        """Return whether the shown page may be left."""
        return True

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if dropped_file(event.mimeData()) is not None and self.may_take_files():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        path = dropped_file(event.mimeData())
        if path is not None and self.may_take_files():
            event.acceptProposedAction()
            self.take_file(path)

    def event(self, event: QEvent) -> bool:
        """Keep Esc from the shortcuts of the page while a notice is shown."""
        keys = (Qt.Key.Key_Escape,) if self.banner.keeps_esc() else ()
        return keeps_keys(event, keys) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not (event.key() == Qt.Key.Key_Escape and self.banner.dismiss()):
            super().keyPressEvent(event)
