"""Check that the files behind a status exist and are unchanged.

Records are named by their hash; events name session files by the SHA-256 of their bytes. A file
with unchanged inode, length and times is not re-read every time, but one in turn is, every
`PATROL_S`, to detect edits that preserve all of them. In large stores each check covers the newest
files and a moving window of the others.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec

from ocmm_core.calibration.records._sealed import is_sealed_as
from ocmm_core.errors import CalibrationError
from ocmm_core.side_files import LARGEST_JOB, read_guarded

PATROL_S = 1.0
"""Interval between re-reads of files that appear unchanged, s."""
AT_A_LOOK = 40
"""Number of newest files, and of others in turn, inspected by each check."""

Stamp = tuple[int, int, int, int]
"""Inode, length, and times of the last change of content and of anything else, ns."""


class KeptFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file in the folder of a store."""

    name: str
    """Below the folder, with forward slashes."""
    sha256: str
    """Hash of the bytes; for a record (``<hash>.json``), of its content, which names it."""

    @property
    def is_record(self) -> bool:
        """Return whether the name is the hash of the content."""
        return self.name == f"{self.sha256}.json"

    def words(self, folder: Path) -> str:
        """Return kind and path for messages; records with a shortened hash."""
        if self.is_record:
            return f"Record {self.sha256[:12]} in {folder}"
        path = folder / self.name
        return f"Session {path.name} in {path.parent}"


def record_file(digest: str) -> KeptFile:
    return KeptFile(f"{digest}.json", digest)


def session_files(folder: Path, session: Path | None) -> tuple[KeptFile, ...]:
    """Return a session file below the store's folder; CalibrationError if unreadable."""
    if session is None or not session.resolve().is_relative_to(folder.resolve()):
        return ()
    name = session.resolve().relative_to(folder.resolve()).as_posix()
    try:
        return (KeptFile(name, hashlib.sha256(read_guarded(session, LARGEST_JOB)).hexdigest()),)
    except OSError as error:
        raise CalibrationError(
            "evidence.unreadable",
            f"{session}: the session cannot be read ({error.strerror}).",
            "Restore read permission, then accept the result again.",
        ) from error


class EvidenceCheck:
    """Verifies the files of a folder; thread-safe."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._good: dict[KeptFile, Stamp] = {}
        self._bad: set[KeptFile] = set()
        self._begun = False
        self._window = 0
        self._turn = 0
        self._patrolled = time.monotonic()

    def defect(self, wanted: Sequence[KeptFile], *, thorough: bool) -> tuple[KeptFile, str] | None:
        """Return the first changed or missing file with its defect; ``thorough`` reads all."""
        with self._lock:
            if thorough:
                self._good.clear()
            elif wanted and time.monotonic() - self._patrolled >= PATROL_S:
                self._patrolled, self._turn = time.monotonic(), self._turn + 1
                self._good.pop(wanted[self._turn % len(wanted)], None)
            for one in wanted if thorough or not self._begun else self._chosen(wanted):
                what = self._look(one)
                if what:
                    return one, what
            # After a defect, the files behind it have not been read yet.
            self._begun = True
        return None

    def lost(self, wanted: Sequence[KeptFile]) -> tuple[str, ...]:
        """Return the names of the files that are not as they were; reads all of them."""
        with self._lock:
            self._good.clear()
            return tuple(one.name for one in wanted if self._look(one))

    def _chosen(self, wanted: Sequence[KeptFile]) -> list[KeptFile]:
        """Return the files to inspect now: defective ones, the newest, a window of the others."""
        old, new = wanted[:-AT_A_LOOK], wanted[-AT_A_LOOK:]
        self._window = self._window + AT_A_LOOK if self._window + AT_A_LOOK < len(old) else 0
        window = old[self._window : self._window + AT_A_LOOK]
        wrong = [one for one in old if one in self._bad] if self._bad else []
        return [*wrong, *window, *new]

    def _look(self, wanted: KeptFile) -> str:
        """Return and remember the defect of a file; empty if it is intact."""
        what = self._what_is_wrong(wanted)
        if what:
            self._bad.add(wanted)
        else:
            self._bad.discard(wanted)
        return what

    def _what_is_wrong(self, wanted: KeptFile) -> str:
        path = self._folder / wanted.name
        try:
            stamp = stamp_of(path)
            if stamp is None:
                return "is missing"
            if self._good.get(wanted) == stamp:
                return ""
            content = read_guarded(path, LARGEST_JOB, follow=False)
        except OSError as error:
            return f"cannot be read ({error.strerror})"
        if wanted.is_record:
            whole = is_sealed_as(content, wanted.sha256)
        else:
            whole = hashlib.sha256(content).hexdigest() == wanted.sha256
        if not whole:
            return "was changed after it was written"
        self._good[wanted] = stamp
        return ""


def stamp_of(path: Path) -> Stamp | None:
    """Return the file's stamp, None if missing; OSError if it cannot be inspected."""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
