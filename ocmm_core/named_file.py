"""Files that are written, and whether their name still means them.

After a sync of the descriptor the file may still have been removed, moved, replaced or unmounted.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from ocmm_core.documents import write_new
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.host import HOST

_MOST_NAMES = 10_000


@dataclass(frozen=True, slots=True)
class NameLoss:
    """Why a name no longer means the file that is written."""

    words: str
    """What happened, to be written after the name and a colon."""
    moved_to: Path | None = None
    """Present path of the file; None if it has none."""


class NamedFile:
    """The identity of a file that is written, compared with its name; OSError if missing.

    `state`: of the file that is written, e.g. by its descriptor; None for the one at `path`.
    """

    def __init__(self, path: Path, state: os.stat_result | None = None) -> None:
        self.path = path.absolute()
        self._descriptor = HOST.hold_name(self.path)
        found = self.path.stat() if self._descriptor < 0 else os.fstat(self._descriptor)
        self._state = state or found
        self._content: tuple[int, int] | None = None

    def state(self) -> os.stat_result | None:
        """Return the state of the file under its name; None if the name means something else."""
        try:
            found = self.path.stat()
        except OSError:
            return None
        same = os.path.samestat(found, self._state) and stat.S_ISREG(found.st_mode)
        return found if same else None

    def note_content(self) -> None:
        """Remember size and time of the last change, after the program itself has written."""
        found = self.state()
        self._content = None if found is None else (found.st_size, found.st_mtime_ns)

    def forget_content(self) -> None:
        """Compare no content until the next `note_content`."""
        self._content = None

    def is_as_noted(self) -> bool:
        """Return whether the name means this file, with the size and time that were noted."""
        found = self.state()
        if found is None:
            return False
        return self._content in (None, (found.st_size, found.st_mtime_ns))

    def has_noted_size(self) -> bool:
        """Return whether the file has the size that was noted; True if none was."""
        found = self.state()
        return self._content is None or (found is not None and found.st_size == self._content[0])

    def loss(self) -> NameLoss | None:
        """Return why the name no longer means the file; None while it does."""
        return None if self.state() is not None else self._loss()

    def remove(self) -> bool:
        """Remove the name if it still means the file; return whether it did. OSError if denied."""
        return HOST.remove_same(self.path, self._state.st_dev, self._state.st_ino)

    def close(self) -> None:
        """Give up the descriptor; may be called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def __del__(self) -> None:
        with contextlib.suppress(AttributeError):
            self.close()

    def _loss(self) -> NameLoss:
        path, descriptor = self.path, self._descriptor
        if descriptor >= 0 and not HOST.is_mounted(descriptor):
            return NameLoss("its file system was unmounted")
        other = "and another file took its name" if os.path.lexists(path) else ""
        there = None if descriptor < 0 else HOST.place_of(descriptor)
        if there is not None:
            if not path.parent.exists() and there.name == path.name:
                return NameLoss(f"its folder was moved to {there.parent}", there)
            return NameLoss(f"it was moved to {there} {other}".rstrip(), there)
        try:
            path.parent.stat()
        except FileNotFoundError:
            return NameLoss("its folder was removed")
        except OSError as error:
            return NameLoss(f"its folder cannot be reached ({error.strerror})")
        return NameLoss("it was replaced by another file" if other else "it was removed")


@dataclass(frozen=True, slots=True)
class FileIdentity:
    """A file that was read, to be compared with its name before something is written about it."""

    path: Path
    device: int
    inode: int

    @classmethod
    def of_written(cls, path: Path) -> FileIdentity:
        """Return the identity of a file that was just written; OSError if it is gone."""
        state = path.lstat()
        return cls(path, state.st_dev, state.st_ino)

    def remove(self) -> None:
        """Remove the file; another one under its name stays. OSError as `os.unlink`."""
        HOST.remove_same(self.path, self.device, self.inode)

    def require_name(self) -> None:
        """Raise StorageError if the path no longer means this file."""
        try:
            found = self.path.stat()
        except OSError:
            words = "it was removed or moved"
        else:
            if (found.st_dev, found.st_ino) == (self.device, self.inode):
                return
            words = "it was replaced by another file"
        raise StorageError(
            "job.lost",
            f"{self.path}: {words} after it was read. Nothing is written about it.",
            "Put the file back, or open it where it is now, then repeat.",
        )


def rescue_folders() -> tuple[Path, ...]:
    """Return the folders for data whose own file is lost: of the settings, and of the user."""
    # Settings are kept in files of chained lines, which are named files.
    from ocmm_core.settings import SettingsStore

    second = None
    with contextlib.suppress(OcmmError):
        second = SettingsStore.of_this_user().load().settings.job_rescue
    own = platformdirs.user_data_path("ocmm") / "rescued"
    return (own,) if second is None else (second, own)


def write_rescued(name: str, content: bytes | Callable[[Path], bytes]) -> Path | None:
    """Write data to a new file in the first folder that takes them; return its path or None.

    `name`: of the lost file; a number is added. `content`: data, or their function of the new path.
    """
    stem, suffix = os.path.splitext(name)  # noqa: PTH122 - a name may begin with a full stop
    for folder in rescue_folders():
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            for number in range(1, _MOST_NAMES):
                path = folder.absolute() / f"{stem}-rescued-{number:03d}{suffix}"
                if os.path.lexists(path):
                    continue
                with contextlib.suppress(FileExistsError):
                    write_new(path, content if isinstance(content, bytes) else content(path))
                    return path
    return None
