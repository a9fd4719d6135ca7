"""Recently used plans, jobs and folders; losing the list does no harm."""

from __future__ import annotations

import contextlib
from pathlib import Path

import msgspec

from ocmm_core.documents import decode_json, read_bytes, resource, write_atomic
from ocmm_core.errors import OcmmError

_SCHEMA = "ocmm.recent/1"
_MOST = 20
_LARGEST = 1 << 18


class _Places(msgspec.Struct, frozen=True):
    schema: str = _SCHEMA
    plans: list[str] = msgspec.field(default_factory=list)
    jobs: list[str] = msgspec.field(default_factory=list)
    folders: list[str] = msgspec.field(default_factory=list)


class RecentPlaces:
    """Recent places, newest first; unreadable: empty; ``path`` None: state folder of this user."""

    def __init__(self, path: Path | None = None) -> None:
        if path is None:
            import platformdirs

            path = platformdirs.user_state_path("ocmm") / "recent.json"
        self._path = path

    def plans(self) -> tuple[Path, ...]:
        """Return plans that were measured or edited and still exist."""
        return _there(self._read().plans)

    def jobs(self) -> tuple[Path, ...]:
        """Return jobs that were measured or opened and still exist."""
        return _there(self._read().jobs)

    def folders(self) -> tuple[Path, ...]:
        """Return folders in which something was opened and that still exist."""
        return _there(self._read().folders)

    def note_plan(self, path: Path) -> None:
        """Put a plan first, unless it is shipped with the program."""
        if not is_shipped(path):
            self._note(plans=path, folders=path.parent)

    def note_job(self, path: Path) -> None:
        self._note(jobs=path, folders=path.parent)

    def _note(self, **new: Path) -> None:
        now = self._read()
        lists = {
            kind: [
                str(path.absolute()),
                *(old for old in getattr(now, kind) if old != str(path.absolute())),
            ][:_MOST]
            for kind, path in new.items()
        }
        content = msgspec.json.encode(msgspec.structs.replace(now, **lists))
        # Two programs at once: one entry is lost, which is harmless.
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(self._path, content)

    def _read(self) -> _Places:
        try:
            found = decode_json(read_bytes(self._path, _LARGEST), _Places)
        except (OcmmError, msgspec.MsgspecError):
            return _Places()
        return found if found.schema == _SCHEMA else _Places()


def is_shipped(path: Path) -> bool:
    """Return whether a path is part of the (read-only) program."""
    with contextlib.suppress(OSError, RuntimeError):
        return path.expanduser().resolve().is_relative_to(resource().resolve())
    return False


def _there(names: list[str]) -> tuple[Path, ...]:
    found = []
    for name in names[:_MOST]:
        # Names with a null character, or on a disk that is gone.
        with contextlib.suppress(OSError, ValueError):
            if Path(name).exists():
                found.append(Path(name))
    return tuple(found)
