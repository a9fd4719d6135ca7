"""The files that a standing rests on: each must be there, and as it was when it was stored.

A record is named by its hash, and an event names the session file that the record came from by
the hash of its bytes. `EvidenceCheck` reads them again. A file whose inode, length and times are
those of when it was read last is not read at every look; one file in turn is, every
`PATROL_S`, so that also an edit that kept all of them is noticed. Of a store that is many years old
not all files are looked at each time, but the newest, and the others in turn.
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
"""Between two readings of a file that looks unchanged."""
AT_A_LOOK = 40
"""So many of the newest files are looked at each time, and so many of the others in turn."""

Stamp = tuple[int, int, int, int]
"""Inode, length, and times of the last change of content and of anything else, ns."""


class KeptFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file in the folder of a store."""

    name: str
    """Below the folder, with forward slashes."""
    sha256: str
    """Of its bytes; of a record (``<hash>.json``) that of its content, which names it."""

    @property
    def is_record(self) -> bool:
        """Return whether the name is the hash of the content."""
        return self.name == f"{self.sha256}.json"

    def words(self, folder: Path) -> str:
        """Return what it is and where; a record by as much of its name as the history shows."""
        if self.is_record:
            return f"Record {self.sha256[:12]} in {folder}"
        path = folder / self.name
        return f"Session {path.name} in {path.parent}"


def record_file(digest: str) -> KeptFile:
    """Return the file of a record."""
    return KeptFile(f"{digest}.json", digest)


def session_files(folder: Path, session: Path | None) -> tuple[KeptFile, ...]:
    """Return the session file that a record comes from, where it is kept below the store.

    Raises
    ------
    CalibrationError
        It cannot be read.
    """
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
    """Looks at the files of a folder; may be asked from any thread."""

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
        """Return the first file that is not as it was, and what is wrong; None where all are.

        Parameters
        ----------
        wanted
            All files that must be there.
        thorough
            Read all of them, whatever they look like.
        """
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
            # Where one is wrong, those behind it were not read yet.
            self._begun = True
        return None

    def lost(self, wanted: Sequence[KeptFile]) -> tuple[str, ...]:
        """Return the names of the files that are not as they were; reads all of them."""
        with self._lock:
            self._good.clear()
            return tuple(one.name for one in wanted if self._look(one))

    def _chosen(self, wanted: Sequence[KeptFile]) -> list[KeptFile]:
        """Return what is looked at this time: what was wrong, the newest, some of the others."""
        old, new = wanted[:-AT_A_LOOK], wanted[-AT_A_LOOK:]
        self._window = self._window + AT_A_LOOK if self._window + AT_A_LOOK < len(old) else 0
        window = old[self._window : self._window + AT_A_LOOK]
        wrong = [one for one in old if one in self._bad] if self._bad else []
        return [*wrong, *window, *new]

    def _look(self, wanted: KeptFile) -> str:
        """Return what is wrong with a file, and remember it; empty where nothing is."""
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
    """Return what a file looks like from outside; None where there is none.

    Raises
    ------
    OSError
        It cannot be looked at.
    """
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
