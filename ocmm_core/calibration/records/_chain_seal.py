"""The seal of a chain of events: how many lines there are and the hash of the last one.

A chain (`chain_file`) shows every change but one: lines cut off at its end. The seal is a second
file that says where the chain ends. It is written twice for each event: before the line, with the
hash that the line will have, and after it. So a crash at any moment leaves a chain and a seal
that fit, and a chain that is shorter, or a seal that is older, do not.

A folder of records that is replaced by an older copy of itself is whole; nothing in it says that
something is missing. So how far each history went is also kept apart from it, among the state of
this user. It is a memory and no seal: another computer, another user or another place of the
folder has none, and where it is lost nothing is known.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path
from typing import Any

import msgspec
import platformdirs

from ocmm_core.calibration.records._sealed import seal, unseal
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError, StorageError

SCHEMA = "ocmm.events-seal/1"
NAME = "events.seal.json"


class ChainSeal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a chain ends.

    Attributes
    ----------
    schema
        `SCHEMA`.
    count
        Lines that are on the disk.
    link
        Hash of the last of them; empty where there is none.
    coming
        Hash of a line that was being written; empty where none was.
    """

    schema: str
    count: int
    link: str
    coming: str = ""


def read_seal(folder: Path) -> ChainSeal | None:
    """Return the seal of a folder; None where there is none.

    Raises
    ------
    StorageError
        It is not as it was written, or cannot be read.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        return unseal(path, read_bytes(path), ChainSeal)
    except CalibrationError as error:
        raise StorageError(
            "events.seal",
            f"{path}: the seal of the history was changed after it was written.",
            RESTORE,
        ) from error


def write_seal(folder: Path, chain: ChainFile[Any], coming: str = "") -> None:
    """Write where a chain ends.

    Raises
    ------
    StorageError
        The folder cannot be written.
    """
    link = chain.links[-1] if chain.links else ""
    content = seal(ChainSeal(schema=SCHEMA, count=len(chain.links), link=link, coming=coming))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(folder / NAME, content)
    except OSError as error:
        raise StorageError(
            "events.seal_unwritable",
            f"{folder / NAME}: the seal of the history could not be written ({error.strerror}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error


def fault_of(chain: ChainFile[Any], end: ChainSeal | None, *, needed: bool) -> StorageError | None:
    """Return what is wrong between a chain and its seal; None where they fit.

    Parameters
    ----------
    needed
        A line of the chain was written together with a seal: there must be one.
    """
    folder = chain.path.parent
    if end is None:
        if not needed:
            return None
        return StorageError(
            "events.seal_missing",
            f"{folder / NAME}: the seal of the history is missing, so it is unknown whether "
            "events were removed.",
            RESTORE,
        )
    count, link = len(chain.links), chain.links[-1] if chain.links else ""
    if (count, link) == (end.count, end.link) and not (chain.torn and not end.coming):
        return None
    if end.coming and (count, link) == (end.count + 1, end.coming) and not chain.torn:
        return None
    if count < end.count:
        what = f"{end.count - count} of {end.count} events are missing at the end"
    elif count == end.count and chain.torn:
        what = "data follow the last event"
    else:
        what = f"its end (event {count}) is not the sealed one (event {end.count})"
    return StorageError("events.cut", f"{chain.path}: {what}.", RESTORE)


RESTORE = (
    "Restore the whole folder from a backup. If there is none, move the folder away, then "
    "calibrate and verify again: a new history starts."
)


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
