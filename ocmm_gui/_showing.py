"""Showing and ending of windows, and archive upload: delivering process, queueing of jobs."""

from __future__ import annotations

import contextlib
import gc
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QEvent, Qt, QTimer
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.home import StartChoice, StartPurpose
from ocmm_gui.kit import THEMES, PlainLabel, apply_theme, text_font, tr

if TYPE_CHECKING:
    from ocmm_core.composition import BuiltStation
    from ocmm_shop.archive.outbox import HandOverProcess
    from ocmm_shop.archiving import ArchiveWatch


_SENDER_MS = 5000


class HandOverSender:
    """Start the delivering process, which reads ``store``, after the window is shown; end it."""

    def __init__(self, store: SettingsStore) -> None:
        self._store = store
        self._process: HandOverProcess | None = None
        self._ended = False
        QTimer.singleShot(_SENDER_MS, self._start)

    def close(self) -> None:
        """End the process, and never restart it."""
        self._ended = True
        if self._process is not None:
            self._process.close()

    def _start(self) -> None:
        if self._ended:
            return
        # Loaded late: the first page is shown before numerical libraries are loaded.
        from ocmm_shop.archive.outbox import HandOverProcess
        from ocmm_shop.archiving import archive_place

        # The start page and the settings show faults of the address.
        with contextlib.suppress(OcmmError):
            place = archive_place(settings=self._store.load().settings)
            if place is not None:
                self._process = HandOverProcess(place)
                self._process.start()


def watch_jobs(
    built: BuiltStation, loaded: LoadedSettings, choice: StartChoice
) -> ArchiveWatch | None:
    """Return the watch that queues the jobs of a station; None if nothing is archived."""
    from ocmm_shop.archiving import ArchiveWatch, archive_place

    if choice.errand is StartPurpose.DEMO:
        # Demonstrations keep only their file.
        return None
    try:
        place = archive_place(settings=loaded.settings)
    except OcmmError:
        return None
    return None if place is None else ArchiveWatch(built.station, place.outbox)


_QUIT_EVERY_MS = 20


def show(window: QMainWindow, size: tuple[int, int] | None) -> None:
    """Show a window in a size; None: maximised."""
    if size is None:
        # Without a window manager nothing else gives it the screen.
        window.setGeometry(window.screen().availableGeometry())
        window.showMaximized()
    else:
        window.resize(*size)
        window.show()


def end_after(seconds: float, end: Callable[[], object]) -> None:
    """Call ``end`` after a time; zero never does."""
    if seconds > 0.0:
        QTimer.singleShot(round(1000.0 * seconds), end)


def save_pictures(window: QWidget, paths: Sequence[Path]) -> bool:
    """Save the window's last picture; return whether every file could be written."""
    saved = True
    for path in paths:
        if not window.grab().save(str(path)):
            sys.stderr.write(f"The picture {path} cannot be written.\n")
            saved = False
    return saved


def let_go() -> None:
    """Free the memory of a closed window and its station; call it without references to them.

    Between two windows no event loop runs that would delete them, and objects created before the
    window was shown are frozen for the garbage collector.
    """
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.unfreeze()
    gc.collect()


def splash(app: QApplication, source: str, theme: str) -> QLabel:
    """Show that the window is starting, and with which source; the caller closes it."""
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
    # Repeated: before the loop of a window runs, and while events are handled during the start,
    # quitting has no effect.
    ending = QTimer(app, interval=_QUIT_EVERY_MS)
    ending.timeout.connect(app.quit)

    def end(number: int, frame: FrameType | None) -> None:
        ending.start()

    # The timer of the live values lets Python handle signals.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
