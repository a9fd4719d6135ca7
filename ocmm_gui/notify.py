"""What went wrong, for people: one log, one banner, and the hooks that feed them."""

from __future__ import annotations

import logging
import sys
import threading
import traceback
from collections import deque
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QSizePolicy, QWidget

from ocmm_core.documents import write_atomic
from ocmm_core.errors import OcmmError
from ocmm_gui.theme import Theme

INFO_SECONDS = 12
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Notice:
    """One thing that the inspector should know.

    Attributes
    ----------
    is_error
        Something went wrong; an error stays until it is dismissed.
    what, remedy
        What happened, and what to do about it (may be empty).
    detail
        Full text for the log, e.g. a traceback; never on the screen.
    when
        Local time.
    """

    is_error: bool
    what: str
    remedy: str
    detail: str
    when: datetime


class NoticeCentre(QObject):
    """Keep the last notices and tell who listens; `post` may be called on any thread."""

    posted = Signal(object)
    """Emits a `Notice` on the window's thread."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._notices: deque[Notice] = deque(maxlen=500)

    def post(self, notice: Notice) -> None:
        """Log a notice and show it."""
        self._notices.append(notice)
        _log.log(
            logging.ERROR if notice.is_error else logging.INFO,
            "%s %s %s", notice.what, notice.remedy, notice.detail,
        )  # fmt: skip
        self.posted.emit(notice)

    def inform(self, what: str) -> None:
        """Show good news."""
        self.post(Notice(False, what, "", "", datetime.now().astimezone()))

    def error(self, error: BaseException) -> None:
        """Show an error: an `OcmmError` in its own words, any other as an internal one."""
        detail = "".join(traceback.format_exception(error))
        now = datetime.now().astimezone()
        if isinstance(error, OcmmError):
            self.post(Notice(True, error.what, error.remedy, detail, now))
        else:
            name = type(error).__name__
            self.post(
                Notice(
                    True,
                    f"Something inside the program failed ({name}).",
                    "Go on measuring if the readout is READY; press L to save the log for support.",
                    detail,
                    now,
                )
            )

    def save(self, path: Path) -> None:
        """Write all kept notices with their full text to a file.

        Raises
        ------
        OcmmError
            The file cannot be written.
        """
        text = "\n".join(
            f"{n.when.isoformat()} {'ERROR' if n.is_error else 'INFO'} {n.what} {n.remedy}\n"
            f"{n.detail}"
            for n in list(self._notices)
        )
        write_atomic(path, (text or "Nothing was reported.\n").encode())


class ErrorHooks:
    """Feed what nobody caught to a `NoticeCentre` while the context is open."""

    def __init__(self, centre: NoticeCentre) -> None:
        self._centre = centre
        self._previous = (sys.excepthook, threading.excepthook)

    def __enter__(self) -> ErrorHooks:
        self._previous = (sys.excepthook, threading.excepthook)
        sys.excepthook = self._on_error
        threading.excepthook = self._on_thread_error
        return self

    def __exit__(self, *_: object) -> None:
        sys.excepthook, threading.excepthook = self._previous

    def _on_error(
        self, kind: type[BaseException], error: BaseException, where: TracebackType | None
    ) -> None:
        if issubclass(kind, KeyboardInterrupt):
            self._previous[0](kind, error, where)
        else:
            self._centre.error(error)

    def _on_thread_error(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None:
            self._centre.error(args.exc_value)


class Banner(QFrame):
    """The one place where notices appear; it never takes the focus and never blocks."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("banner")
        self.setAccessibleName("Notice")
        self._theme: Theme | None = None
        self._is_error = False
        self._text = QLabel()
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(True)
        self._text.setAccessibleName("Notice text")
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._dismiss = QPushButton("Dismiss")
        self._dismiss.setAccessibleName("Dismiss the notice")
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
        """Show a notice; good news goes away by itself, an error is not covered by it."""
        if self._is_error and not notice.is_error and self.isVisible():
            return
        self._is_error = notice.is_error
        mark = "✖" if notice.is_error else "✔"
        self._text.setText(f"{mark}  {notice.what} {notice.remedy}".rstrip())
        self._paint()
        self.show()
        if notice.is_error:
            self._timer.stop()
        else:
            self._timer.start()

    def text(self) -> str:
        """Return what the banner says."""
        return self._text.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._paint()

    def _paint(self) -> None:
        if self._theme is not None:
            colour = self._theme.bad if self._is_error else self._theme.good
            self.setStyleSheet(
                f"#banner {{ background: {self._theme.panel}; border: 2px solid {colour};"
                f" border-radius: 6px; }} QLabel {{ color: {colour}; font-weight: bold; }}"
            )
