"""Notes of running jobs, so that none is lost with a killed program.

A program locks its note; jobs of unlocked notes are queued by the next sweep.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.side_files import LARGEST_JOB, open_guarded, read_guarded
from ocmm_core.storage import JobFile
from ocmm_shop.archive.outbox._outbox import Outbox

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
