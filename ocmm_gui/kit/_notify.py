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

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy, QWidget

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.failure import contained
from ocmm_gui.kit._narrow import NarrowButton
from ocmm_gui.kit._texts import PlainLabel, said, tr
from ocmm_gui.kit._theme import Theme, text_font

INFO_SECONDS = 12
_AGAIN_S = 5.0
_FAR_SHARE, _DESK_PX = 26.0 / 1080.0, 14.0
"""Type size: relative to the window height, and in pixels."""


class Level(Enum):
    """Severity: value for the log; determines mark and colour of the banner."""

    INFO = "INFO"
    WARNING = "WARNING"
    ERROR = "ERROR"


_MARKS = {Level.INFO: "✔", Level.WARNING: "⚠", Level.ERROR: "✖"}


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


class NoticeCentre(QObject):
    """Store the last notices and notify listeners; `post` is thread-safe."""

    posted = Signal(object)

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

    def inform(self, what: str) -> None:
        self.post(Notice(Level.INFO, what, "", "", datetime.now().astimezone()))

    def warn(self, what: str, remedy: str = "") -> None:
        self.post(Notice(Level.WARNING, what, remedy, "", datetime.now().astimezone()))

    def error(self, error: BaseException) -> None:
        """Show an error: `OcmmError` in its own words, others as `failure.contained`."""
        detail = "".join(traceback.format_exception(error))
        told = contained(error, "The window")
        when = datetime.now().astimezone()
        self.post(Notice(Level.ERROR, told.what, told.remedy, detail, when))

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


class Banner(QFrame):
    """The only display of notices; takes no focus and never blocks."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("banner")
        self.setAccessibleName(tr("Notice"))
        self._theme: Theme | None = None
        self._level = Level.INFO
        self._text = PlainLabel()
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(True)
        self._text.setAccessibleName(tr("Notice text"))
        self._far = False
        self._set_font()
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._dismiss = NarrowButton(tr("Dismiss  [Esc]"))
        self._dismiss.setAccessibleName(tr("Dismiss this message"))
        self._dismiss.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._dismiss.clicked.connect(self.hide)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 6, 8, 6)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._dismiss)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(INFO_SECONDS * 1000)
        self._timer.timeout.connect(self.hide)
        self.hide()

    def show_notice(self, notice: Notice) -> None:
        """Show a notice; information disappears, and only an error replaces an error."""
        covered = self._level is Level.ERROR and self.isVisible()
        if covered and notice.level is not Level.ERROR:
            return
        self._level = notice.level
        self._text.setText(
            f"{_MARKS[notice.level]}  {said(notice.what)} {said(notice.remedy)}".rstrip()
        )
        self._set_font()
        self._paint()
        self.show()
        if notice.level is Level.INFO:
            self._timer.start()
        else:
            self._timer.stop()

    def use_far(self, *, far: bool) -> None:
        """Set the type for far or near reading."""
        self._far = far
        self._set_font()

    def text(self) -> str:
        return self._text.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._paint()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Adapt the type size to the window."""
        super().resizeEvent(event)
        self._set_font()

    def _set_font(self) -> None:
        pixels = max(_FAR_SHARE * self.window().height(), _DESK_PX) if self._far else _DESK_PX
        self._text.setFont(text_font(pixels, bold=True))

    def _paint(self) -> None:
        if self._theme is not None:
            colour = {
                Level.INFO: self._theme.good,
                Level.WARNING: self._theme.warn,
                Level.ERROR: self._theme.bad,
            }[self._level]
            self.setStyleSheet(
                f"#banner {{ background: {self._theme.panel}; border: 2px solid {colour};"
                f" border-radius: 6px; }} QLabel {{ color: {colour}; }}"
            )
