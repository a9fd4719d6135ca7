"""The delivering process, one per outbox; low priority, ends with its parent.

Running jobs have notes, so that none is lost with a killed program: a program locks its note, and
jobs of unlocked notes are queued by the next sweep.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.side_files import LARGEST_JOB, open_guarded, read_guarded
from ocmm_core.storage import JobFile
from ocmm_shop.archive.outbox._courier import BackOff, Courier
from ocmm_shop.archive.outbox._outbox import Outbox
from ocmm_shop.archive.stores import open_archive

_FOLDER = "measuring"
_LONGEST = 1 << 16
_TRIES = 20


class JobNote:
    """Note a running job; durable on return; StorageError if it cannot be written."""

    def __init__(self, folder: Path, path: Path) -> None:
        self.path = path
        text = str(path.absolute()).encode("utf-8", "surrogateescape")
        self._file = folder / _FOLDER / hashlib.sha256(text).hexdigest()
        self._descriptor: int | None = None
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            descriptor = _held(self._file)
            if descriptor is None:
                # Another program notes the same job, which is equivalent.
                return
            self._descriptor = descriptor
            os.ftruncate(descriptor, 0)
            os.write(descriptor, text)
            os.fsync(descriptor)
        except OSError as error:
            self.let_go()
            raise StorageError(
                "outbox.failed",
                f"{folder}: the outbox of the archive cannot be written ({error.strerror}).",
                "Free disk space or check the rights of the folder. The job file itself is safe: "
                "put it in later with ocmm archive send FILE.",
            ) from error

    def done(self) -> None:
        """Remove the note after the job was queued completely."""
        if self._descriptor is not None:
            # Some systems cannot remove open files; there the next sweep does.
            with contextlib.suppress(OSError):
                _remove(self._file, self._descriptor)
        self.let_go()

    def let_go(self) -> None:
        """Leave the note to the next sweep; may be called twice."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def sweep(outbox: Outbox) -> int:
    """Queue the jobs whose program ended before it did, or whose outbox is lost; return how many.

    Missing jobs and jobs without points are skipped. Unreadable ones are queued as they are: the
    delivery sets them aside and names them. StorageError for the outbox.
    """
    found = outbox.queue_unlisted()
    for note in sorted((outbox.folder / _FOLDER).glob("*")):
        try:
            descriptor = _held(note, make=False)
        except OSError:
            continue
        if descriptor is None:
            continue
        try:
            text = os.read(descriptor, _LONGEST)
            if text and _put(outbox, Path(os.fsdecode(text))):
                found += 1
            with contextlib.suppress(OSError):
                _remove(note, descriptor)
        finally:
            os.close(descriptor)
    return found


def _remove(note: Path, descriptor: int) -> None:
    state = os.fstat(descriptor)
    HOST.remove_same(note, state.st_dev, state.st_ino)


def has_points(path: Path) -> bool:
    """Return whether a job has a point; errors as those of `JobFile.read`."""
    with JobFile.read(path) as job:
        return job.next_number() > 1


def _put(outbox: Outbox, path: Path) -> bool:
    try:
        if not path.is_file():
            return False
        return has_points(path) and outbox.put(path) is not None
    except OcmmError as error:
        if error.code.startswith("outbox."):
            raise
    try:
        content = read_guarded(path, LARGEST_JOB)
    except OSError:
        return False
    return outbox.put_content(content, path) is not None


def _held(file: Path, *, make: bool = True) -> int | None:
    """Lock a note and return its descriptor; None if another process holds it."""
    for _ in range(_TRIES):
        descriptor = open_guarded(file, follow=False, flags=os.O_RDWR | os.O_CREAT * make)
        try:
            HOST.lock(descriptor)
        except BlockingIOError:
            os.close(descriptor)
            return None
        # Its former holder may have removed it: then the path is another file.
        if HOST.is_at(descriptor, file):
            return descriptor
        os.close(descriptor)
        if not make:
            return None
    return None


_LOOK_S = 2.0
"""Polling interval of the outbox, s."""
_NICE = 10
_END_S = 2.0


@dataclass(frozen=True, slots=True)
class ArchivePlace:
    """Places of archive and outbox. `address`, `password`: as for `open_archive`."""

    address: str
    station: str
    """Empty is the name of this computer."""
    outbox: Path
    password: Path | None = None

    def courier(self, outbox: Outbox) -> Courier:
        return Courier(
            outbox, lambda: open_archive(self.address, password=self.password), self.station
        )


@contextlib.contextmanager
def only_one(folder: Path) -> Iterator[bool]:
    """Yield whether no other process delivers from this outbox; locked until the end."""
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = open_guarded(folder / "lock", flags=os.O_RDWR | os.O_CREAT)
    try:
        try:
            HOST.lock(descriptor)
        except BlockingIOError:
            yield False
        else:
            yield True
    finally:
        os.close(descriptor)


def follow(place: ArchivePlace, stop: threading.Event, rng: random.Random) -> None:
    """Deliver from the outbox until stopped."""
    HOST.stand_back(_NICE)
    with only_one(place.outbox) as alone:
        if not alone:
            return
        pauses = BackOff(rng)
        with Outbox(place.outbox) as outbox:
            courier = place.courier(outbox)
            sweep(outbox)
            try:
                while not stop.is_set():
                    handed = courier.send_waiting(stop.is_set)
                    if handed.error is None:
                        pauses.good()
                        if handed.sent:
                            outbox.prune()
                        stop.wait(_LOOK_S)
                    else:
                        stop.wait(pauses.next_s())
            finally:
                courier.close()


class HandOverProcess:
    """Starts and ends the delivering process, without waiting for the archive."""

    def __init__(self, place: ArchivePlace) -> None:
        self._place = place
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; it reports errors in the outbox."""
        place = self._place
        password = [] if place.password is None else [str(place.password)]
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            [
                sys.executable, "-m", "ocmm_shop.archive.outbox", place.address, place.station,
                str(place.outbox), *password,
            ],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def close(self) -> None:
        """End it within two seconds; a job in transfer is sent again by the next one."""
        if self._process is None:
            return
        process, self._process = self._process, None
        if process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def main(arguments: list[str]) -> int:
    """Deliver until stdin is closed; return the exit code."""
    address, station, outbox, *password = arguments
    stop = threading.Event()

    def wait_for_end() -> None:
        with contextlib.suppress(OSError):
            while sys.stdin.buffer.read(1):
                pass
        stop.set()

    threading.Thread(target=wait_for_end, daemon=True, name="end").start()
    place = ArchivePlace(address, station, Path(outbox), Path(password[0]) if password else None)
    try:
        follow(place, stop, random.Random(os.getpid()))  # noqa: S311 - pauses only
    except OcmmError:
        # The outbox is unusable, which whoever queues the next job is told.
        return 1
    return 0
