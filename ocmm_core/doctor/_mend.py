"""Applying and reverting changes; previous values are on disk before any change."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.doctor._adapter_checks import change_setting, settings
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import LIMITS, UNDO_FILE, ChangeKind, SystemChange, is_allowed
from ocmm_core.documents import read_bytes, write_atomic, write_new
from ocmm_core.errors import InputError, InternalError, StorageError

_SCHEMA = "ocmm.doctor-undo/1"
_BOOT = "/proc/sys/kernel/random/boot_id"
_MOST_BYTES = 4 << 20


class _Kept(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Stored data for undo."""

    schema: str
    boot: str
    """Boot id; the next boot reverts kernel values and renumbers interrupts."""
    folders: tuple[str, ...]
    """Created folders, outermost first."""
    changes: tuple[SystemChange, ...]


@dataclass(frozen=True, slots=True)
class Mended:
    """Result of one change."""

    change: SystemChange
    complaint: str = ""
    """Why it was not applied or reverted; empty on success."""
    failed: bool = False
    """Refused by the system; may be possible later."""


def mend(computer: Computer, changes: Sequence[SystemChange]) -> tuple[Mended, ...]:
    """Apply changes; raise StorageError, changing nothing, if undo cannot be stored.

    `undo` can revert each, also after a power cut midway.
    """
    _require_allowed(changes)
    if not changes:
        return ()
    kept = _kept(computer)
    boot = _boot(computer)
    folders = kept.folders + _missing_above(computer, UNDO_FILE)
    for change in changes:
        if change.kind is ChangeKind.NEW_FILE:
            folders += _missing_above(computer, change.place)
    folders = tuple(dict.fromkeys(folders))
    before = kept.changes if kept.boot == boot else _lasting(kept.changes)
    try:
        for folder in folders:
            computer.place(folder).mkdir(exist_ok=True)
        _keep(
            computer, _Kept(schema=_SCHEMA, boot=boot, folders=folders, changes=(*before, *changes))
        )
    except OSError as error:
        raise _no_rights(error) from error
    return tuple(_made(computer, change, change.before, change.after) for change in changes)


def undo(computer: Computer) -> tuple[Mended, ...]:
    """Revert all changes, last first; return them in that order.

    Values changed by others since are left alone. InputError if nothing was changed, or the file
    with previous values is damaged; StorageError if this user cannot revert them.
    """
    place = computer.place(UNDO_FILE)
    if not place.exists():
        raise InputError(
            "doctor.nothing_to_undo", "Nothing was changed by --fix.", "There is nothing to undo."
        )
    kept = _kept(computer)
    changes = kept.changes if kept.boot == _boot(computer) else _lasting(kept.changes)
    if not os.access(place.parent, os.W_OK):
        raise _no_rights(PermissionError(1, "Operation not permitted"))
    done = tuple(
        _made(computer, change, change.after, change.before) for change in reversed(changes)
    )
    left = tuple(one.change for one in reversed(done) if one.failed)
    try:
        if left:
            _keep(computer, msgspec.structs.replace(kept, changes=left))
            return done
        place.unlink()
    except OSError as error:
        raise _no_rights(error) from error
    for folder in reversed(kept.folders):
        # It may contain other files by now.
        with contextlib.suppress(OSError):
            computer.place(folder).rmdir()
    return done


def can_undo(computer: Computer) -> bool:
    """Return whether there are changes to revert."""
    return computer.place(UNDO_FILE).exists()


def may_mend(computer: Computer) -> bool:
    """Return whether this user may change the computer, by access to the undo file.

    The root folder is no criterion: a station's system is read-only with overlays.
    """
    folder = computer.place(UNDO_FILE).parent
    while not folder.exists():
        folder = folder.parent
    return os.access(folder, os.W_OK)


def _made(computer: Computer, change: SystemChange, there: str, wanted: str) -> Mended:
    try:
        now = _now(computer, change)
        if now == wanted:
            return Mended(change)
        if now != there:
            return Mended(change, f"it is {now or 'not there'} now; somebody else changed it")
        _write(computer, change, wanted)
    except NotAskedError as error:
        return Mended(change, error.what, failed=True)
    except OSError as error:
        return Mended(change, str(error.strerror), failed=True)
    return Mended(change)


def _now(computer: Computer, change: SystemChange) -> str:
    if change.kind is ChangeKind.ADAPTER:
        name, kind, option = change.place.split()
        return settings(computer, name, kind).get(option, "")
    if change.kind is ChangeKind.NEW_FILE:
        return f"{computer.text(change.place)}\n" if computer.has(change.place) else ""
    return computer.text(change.place)


def _write(computer: Computer, change: SystemChange, value: str) -> None:
    place = computer.place(change.place)
    if change.kind is ChangeKind.ADAPTER:
        name, kind, option = change.place.split()
        change_setting(computer, name, kind, option, value)
    elif change.kind is ChangeKind.NEW_FILE:
        if value:
            write_new(place, value.encode("ascii"))
            # Read by programs of all users, whatever root's umask.
            place.chmod(0o644)
        else:
            place.unlink()
    else:
        # No new file and no link target: the kernel provides this file.
        descriptor = os.open(place, os.O_WRONLY | os.O_TRUNC | os.O_NOFOLLOW)
        try:
            os.write(descriptor, f"{value}\n".encode("ascii"))
        finally:
            os.close(descriptor)


def _keep(computer: Computer, kept: _Kept) -> None:
    content = msgspec.json.format(msgspec.json.encode(kept), indent=1)
    write_atomic(computer.place(UNDO_FILE), content + b"\n")


def _kept(computer: Computer) -> _Kept:
    """Return stored undo data; raise InputError if damaged."""
    place = computer.place(UNDO_FILE)
    if not place.exists():
        return _Kept(schema=_SCHEMA, boot="", folders=(), changes=())
    try:
        kept = msgspec.json.decode(read_bytes(place, _MOST_BYTES), type=_Kept)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _damaged(place) from error
    if kept.schema != _SCHEMA or not all(is_allowed(one) for one in kept.changes):
        raise _damaged(place)
    if not all(
        any(Path(folder) in Path(file).parents for file in (UNDO_FILE, LIMITS))
        for folder in kept.folders
    ):
        raise _damaged(place)
    return kept


def _require_allowed(changes: Sequence[SystemChange]) -> None:
    for change in changes:
        if not is_allowed(change):
            raise InternalError(
                "doctor.change",
                f"A check asked for a change that is none of those it may ask for: {change.place}.",
                "Nothing was changed. Report this.",
            )


def _lasting(changes: Sequence[SystemChange]) -> tuple[SystemChange, ...]:
    """Return the changes that survive a reboot."""
    return tuple(one for one in changes if one.kind is ChangeKind.NEW_FILE)


def _boot(computer: Computer) -> str:
    try:
        return computer.text(_BOOT)
    except NotAskedError:
        return ""


def _missing_above(computer: Computer, path: str) -> tuple[str, ...]:
    """Return the missing parent folders of a path, outermost first."""
    above = [one for one in Path(path).parents if not computer.has(one)]
    return tuple(str(one) for one in reversed(above))


def _no_rights(error: OSError) -> StorageError:
    return StorageError(
        "doctor.no_rights",
        f"This user may not change the computer ({error.strerror}); nothing was changed.",
        "Type the same as root, e.g. with sudo in front.",
    )


def _damaged(place: Path) -> InputError:
    return InputError(
        "doctor.undo_damaged",
        f"{place} does not say what was before; nothing was taken back.",
        "Restart the computer, which takes most changes back, then move that file away.",
    )
