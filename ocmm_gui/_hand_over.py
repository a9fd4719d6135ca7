"""Archive upload from the window: the delivering process, and queueing of jobs."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer

from ocmm_core.errors import OcmmError
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.home import Choice, Errands

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


def watch_jobs(built: BuiltStation, loaded: LoadedSettings, choice: Choice) -> ArchiveWatch | None:
    """Return the watch that queues the jobs of a station; None if nothing is archived."""
    from ocmm_shop.archiving import ArchiveWatch, archive_place

    if choice.errand is Errands.DEMO:
        # Demonstrations keep only their file.
        return None
    try:
        place = archive_place(settings=loaded.settings)
    except OcmmError:
        return None
    return None if place is None else ArchiveWatch(built.station, place.outbox)
