"""How windows come to the screen, and leave it."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

from PySide6.QtCore import QCoreApplication, QEvent, Qt, QTimer
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QWidget

from ocmm_gui.kit import THEMES, PlainLabel, apply_theme, text_font, tr

_QUIT_EVERY_MS = 20


def show(window: QMainWindow, size: tuple[int, int] | None) -> None:
    """Show a window in a size; None: as large as the screen."""
    if size is None:
        # Without a window manager nothing else gives it the screen.
        window.setGeometry(window.screen().availableGeometry())
        window.showMaximized()
    else:
        window.resize(*size)
        window.show()


def end_after(seconds: float, end: Callable[[], object]) -> None:
    """Call ``end`` after so many seconds; zero never does."""
    if seconds > 0.0:
        QTimer.singleShot(round(1000.0 * seconds), end)


def save_pictures(window: QWidget, paths: Sequence[Path]) -> bool:
    """Save what the window showed last, and say whether every file could be written."""
    saved = True
    for path in paths:
        if not window.grab().save(str(path)):
            sys.stderr.write(f"The picture {path} cannot be written.\n")
            saved = False
    return saved


def let_go() -> None:
    """Free what a closed window and its station held; call it where nobody refers to them.

    Between two windows no event loop runs that would delete them, and what stood when the window
    came to the screen was taken out of the search for garbage.
    """
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.unfreeze()
    gc.collect()


def splash(app: QApplication, source: str, theme: str) -> QLabel:
    """Show that the window is starting, and from which source; whoever asked closes it."""
    label = PlainLabel(tr("OCMM\n\nStarting: {source}").format(source=source))
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setWindowTitle("OCMM")
    label.setFont(text_font(20))
    label.resize(520, 200)
    apply_theme(label, THEMES[theme])
    label.show()
    app.processEvents()
    return label


def end_on_signals(app: QApplication) -> None:
    """End the event loop on SIGINT and SIGTERM."""
    # Repeated: before the loop of a window runs, and while events are handled during the start,
    # quitting has no effect.
    ending = QTimer(app)
    ending.setInterval(_QUIT_EVERY_MS)
    ending.timeout.connect(app.quit)

    def end(number: int, frame: FrameType | None) -> None:
        ending.start()

    # The timer of the live values gives Python the turns in which signals are handled.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
