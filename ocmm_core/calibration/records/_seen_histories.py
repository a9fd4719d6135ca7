"""What this computer last saw of each history: a folder that was set back as a whole shows here.

A folder of records that is replaced by an older copy of itself is whole; nothing in it says that
something is missing. So how far each history went is also kept apart from it, among the state of
this user. It is a memory and no seal: another computer, another user or another place of the
folder has none, and where it is lost nothing is known.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.documents import write_atomic


class SeenHistory(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far a history went.

    Attributes
    ----------
    folder
        Where it is.
    count, link
        Events, and the hash of the last one.
    """

    folder: str
    count: int
    link: str


def recall(folder: Path) -> SeenHistory | None:
    """Return how far the history in a folder went; None where nobody knows."""
    try:
        return msgspec.json.decode(_path(folder).read_bytes(), type=SeenHistory)
    except (OSError, msgspec.DecodeError):
        return None


def remember(folder: Path, links: tuple[str, ...]) -> None:
    """Keep how far the history in a folder goes; where it cannot be kept it is not known later."""
    path = _path(folder)
    seen = SeenHistory(folder=str(folder.resolve()), count=len(links), link=links[-1])
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, msgspec.json.encode(seen))


def _path(folder: Path) -> Path:
    name = hashlib.sha256(str(folder.resolve()).encode()).hexdigest()[:32]
    return platformdirs.user_state_path("ocmm") / "histories" / f"{name}.json"
