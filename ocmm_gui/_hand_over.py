"""What the window does for the archive: a process that hands over, and jobs that are put in."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer

from ocmm_core.errors import OcmmError
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.home import Choice, Errands

if TYPE_CHECKING:
    from ocmm_core.archive.outbox import HandOverProcess
    from ocmm_core.composition import BuiltStation
    from ocmm_core.station.archiving import ArchiveWatch

_SENDER_MS = 5000


class HandOverSender:
    """Starts the process that hands jobs over to the archive, when all else stands, and ends it.

    Parameters
    ----------
    store
        Where the archive is; read when the process starts.
    """

    def __init__(self, store: SettingsStore) -> None:
        self._store = store
        self._process: HandOverProcess | None = None
        self._ended = False
        QTimer.singleShot(_SENDER_MS, self._start)

    def close(self) -> None:
        """End it; it does not start any more."""
        self._ended = True
        if self._process is not None:
            self._process.close()

    def _start(self) -> None:
        if self._ended:
            return
        # Loaded only now: the first page is on the screen before numerical libraries are.
        from ocmm_core.archive.outbox import HandOverProcess
        from ocmm_core.station.archiving import archive_place

        # What is wrong with the address stands on the Start page and in the settings.
        with contextlib.suppress(OcmmError):
            place = archive_place(settings=self._store.load().settings)
            if place is not None:
                self._process = HandOverProcess(place)
                self._process.start()


def watch_jobs(built: BuiltStation, loaded: LoadedSettings, choice: Choice) -> ArchiveWatch | None:
    """Return what puts the jobs of a station into the outbox; None where nothing is archived."""
    from ocmm_core.station.archiving import ArchiveWatch, archive_place

    if choice.errand is Errands.DEMO:
        # It shows how it is done; nothing of it is kept but its file.
        return None
    try:
        place = archive_place(settings=loaded.settings)
    except OcmmError:
        return None
    return None if place is None else ArchiveWatch(built.station, place.outbox)
