"""Queue the jobs of a running station in the outbox of the archive, as soon as they are saved.

In: a job that is finished, paused or closed. Out: the same in the outbox; the sender delivers it.

A separate thread waits for a pause, so that bursts become one version, and reads as others do.
Archive and outbox are those of the settings of the station; they change no number (decision 85). It
must not know an archive: measuring does not depend on a server.
"""

from __future__ import annotations

import logging
import threading
from pathlib import Path

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.settings import Settings, SettingsStore
from ocmm_core.station import MeasuringStation
from ocmm_shop.archive.outbox import ArchivePlace, JobNote, Outbox, default_outbox, has_points
from ocmm_shop.archive.stores import check_address, is_server, parse_server

LOCAL, OFF = "local", "off"


def archive_place(
    address: str | None = None, settings: Settings | None = None, outbox: Path | None = None
) -> ArchivePlace | None:
    """Return the places of archive and outbox; None if the archive is off.

    `address` overrides `settings`; these and `outbox` (a folder) default to this user's.
    InputError: the address cannot be used.
    """
    settings = settings or SettingsStore.of_this_user().load().settings
    chosen = (address if address is not None else settings.archive_address).strip()
    if chosen.lower() == OFF:
        return None
    if chosen.lower() == LOCAL:
        chosen = ""
    check_address(chosen)
    password = settings.archive_password
    login = _login(chosen)
    if login is not None and login != _login(settings.archive_address):
        # The password is of another login, e.g. the owner's, whose own is in PGPASSWORD.
        password = None
    return ArchivePlace(chosen, settings.archive_station, outbox or default_outbox(), password)


def required_place(address: str | None, outbox: Path | None = None) -> ArchivePlace:
    """Return the places of archive and outbox; InputError if the archive is off."""
    place = archive_place(address, outbox=outbox)
    if place is None:
        raise InputError(
            "archive.off",
            "The archive is off.",
            "Turn it on: ocmm settings set archive.address local, or give --archive.",
        )
    return place


def _login(address: str) -> tuple[str, str, str] | None:
    """Return user, server and port of an address; None without a server."""
    address = address.strip()
    if not is_server(address):
        return None
    try:
        options = parse_server(address).options
    except InputError:
        return None
    host = options.get("host", "")
    # Server names are case-insensitive; a folder with a socket is not.
    host = host if host.startswith("/") else host.lower()
    return options.get("user", ""), host, options.get("port", "5432")


_log = logging.getLogger(__name__)

QUIET_S = 0.5
PART = "The hand-over to the archive"


class ArchiveWatch:
    """Queue each job of a station; made before the station starts, closed after it."""

    def __init__(self, station: MeasuringStation, folder: Path) -> None:
        self._station, self._folder = station, folder
        self._wake, self._end = threading.Event(), threading.Event()
        self._job = station.job.path
        self._note: JobNote | None = None
        station.events.changed.connect(self._on_changed)
        self._thread = threading.Thread(target=self._run, name="archive")
        self._thread.start()

    def close(self) -> None:
        """Queue the rest; call it after the station has closed its job. May be called twice."""
        if self._end.is_set():
            return
        self._end.set()
        self._wake.set()
        self._thread.join()
        self._station.events.changed.disconnect(self._on_changed)
        self._leave(self._job)

    def _on_changed(self) -> None:
        self._wake.set()

    def _run(self) -> None:
        self._start(self._job)
        while not self._end.is_set():
            self._wake.wait()
            self._wake.clear()
            # Further changes will make another version.
            while not self._end.is_set() and self._wake.wait(QUIET_S):
                self._wake.clear()
            if self._end.is_set():
                return
            try:
                self._poll()
            except Exception as error:
                if self._end.is_set():
                    return
                self._station.faults.note(error, PART)

    def _poll(self) -> None:
        path = self._station.job.path
        if path != self._job:
            # The former job is closed and final.
            before, self._job = self._job, path
            self._leave(before)
            self._start(path)
        if self._station.faults.measuring is not None:
            return
        view = self._station.job.view()
        if view.complete or view.paused:
            self._try(path)

    def _start(self, path: Path) -> None:
        """Note a running job, so that it is found if this program is killed."""
        try:
            self._note = JobNote(self._folder, path)
        except OcmmError as error:
            # Reported once the job is queued: that will probably fail for the same reason.
            _log.warning("%s was not noted: %s", path, error)

    def _leave(self, path: Path) -> None:
        """Queue a job finally; on failure its note stays for the next sweep."""
        note, self._note = self._note, None
        # The name of a lost job may mean another file, now and at the next sweep.
        job = self._station.job
        lost = path == job.path and job.lost is not None
        put = lost or self._try(path)
        if note is not None and put:
            note.done()
        elif note is not None:
            note.let_go()

    def _try(self, path: Path) -> bool:
        """Queue a job if it has a point; errors are reported separately from measuring."""
        try:
            if path.exists() and has_points(path):
                with Outbox(self._folder) as outbox:
                    outbox.put(path)
        except OcmmError as error:
            self._station.faults.note(error, PART)
            _log.warning("%s was not put into the outbox: %s", path, error)
            return False
        return True
