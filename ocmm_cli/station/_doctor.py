"""What the doctor does to a computer: measures wake-ups and a bus, applies and reverts changes.

    python -m ocmm_cli.station._doctor SECONDS

runs in a private network namespace, isolated from the network: it creates a virtual cable, sends a
frame per millisecond on one end and answers on the other. Previous values are on disk before any
change.
"""

from __future__ import annotations

import contextlib
import gc
import os
import select
import socket
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import msgspec

from ocmm_cli.terminal import tr_later
from ocmm_core import doctor
from ocmm_core.acquisition.bus_process import BUS_PRIORITY, CAMERA_PRIORITY, take_priority
from ocmm_core.documents import read_bytes, write_atomic, write_new
from ocmm_core.errors import InputError, InternalError, OcmmError, StorageError
from ocmm_core.fieldbus import wire

_SCHEMA = "ocmm.doctor-undo/1"
_BOOT = "/proc/sys/kernel/random/boot_id"
_MOST_BYTES = 4 << 20
LONGEST_LOOP_S = 10.0
_MODULE = "ocmm_cli.station._doctor"
_ETHERCAT = 0x88A4
_HEAD = bytes.fromhex("ffffffffffff 020000000001 88a4")
_NUMBER = struct.Struct("<I")
_CAMERAS_BYTES = 1072
"""Inputs of two cameras (528 bytes each) and their outputs: a full frame of a small station."""
_LAST_WAIT_NS = 200_000_000


def measured_checks(seconds: float) -> tuple[doctor.CheckSpec, ...]:
    """Return the checks that measure for `seconds`, the bus `LONGEST_LOOP_S` at most; 0: none."""

    def loop() -> doctor.LoopTimes:
        if seconds <= 0.0:
            raise doctor.NotAskedError(
                tr_later("Not measured."), tr_later("Measure it: --seconds 60")
            )
        length = min(seconds, LONGEST_LOOP_S)
        try:
            inside = wire.namespace_command()
        except OcmmError as error:
            raise doctor.NotAskedError(error.what, tr_later("Measure it as root.")) from error
        return doctor.answer_of(
            [*inside, sys.executable, "-m", _MODULE, str(length)], length, doctor.LoopTimes
        )

    about = tr_later("at most 0.05 % of the frames are not answered in their cycle")
    return (
        doctor.wake_check(seconds),
        doctor.CheckSpec(
            "loop",
            tr_later("Bus on a virtual cable"),
            about,
            lambda computer: doctor.judge_loop(loop()),
        ),
    )


def main() -> None:
    """Measure inside the namespace and print JSON."""
    try:
        times = _measure(float(sys.argv[1]))
    except OcmmError as error:
        sys.stderr.write(f"{error.what}\n")
        sys.exit(2)
    sys.stdout.write(msgspec.json.encode(times).decode())


def _measure(seconds: float) -> doctor.LoopTimes:
    wire.make_link(wire.HOST_INTERFACE, wire.CAMERA_INTERFACE)
    with _end(wire.HOST_INTERFACE) as near, _end(wire.CAMERA_INTERFACE) as far:
        # The mirror process ends when this process ends and its pipe closes.
        ends, held = os.pipe()
        mirror = os.fork()
        if mirror == 0:
            os.close(held)
            _reflect(far, ends)
        try:
            return _cycle(near, max(1, round(seconds * 1e9 / doctor.PERIOD_NS)))
        finally:
            os.close(held)
            os.waitpid(mirror, 0)
            os.close(ends)


def _end(interface: str) -> socket.socket:
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETHERCAT))
    end.bind((interface, _ETHERCAT))
    end.setblocking(False)
    return end


def _reflect(far: socket.socket, ends: int) -> NoReturn:
    """Answer every frame, as cameras do, until the other end of a pipe closes."""
    take_priority(CAMERA_PRIORITY)
    try:
        while ends not in select.select([far.fileno(), ends], [], [])[0]:
            far.send(far.recv(2048))
    finally:
        os._exit(0)


def _cycle(near: socket.socket, count: int) -> doctor.LoopTimes:
    real_time = take_priority(BUS_PRIORITY) is None
    clock = wire.HostTime()
    sent, came = [0] * count, [0] * count
    rest = bytes(_CAMERAS_BYTES - _NUMBER.size)
    gc.disable()
    deadline = clock.now_ns() + doctor.PERIOD_NS
    for number in range(count):
        clock.wait_until(deadline)
        sent[number] = clock.now_ns()
        # A late cycle keeps its whole millisecond: only the transit of the frame is measured.
        deadline = max(deadline, sent[number] - doctor.PERIOD_NS) + doctor.PERIOD_NS
        near.send(_HEAD + _NUMBER.pack(number) + rest)
        _await(near, clock, came, number, sent[number] + doctor.PERIOD_NS)
    for number in range(count):
        if not came[number]:
            _await(near, clock, came, number, clock.now_ns() + _LAST_WAIT_NS)
    gc.enable()
    ways = sorted(there - begin for begin, there in zip(sent, came, strict=True) if there)
    if not ways:
        raise doctor.NotAskedError(tr_later("No frame came back."))
    return doctor.LoopTimes(
        cycles=count, lost=count - len(ways), late=sum(one > doctor.PERIOD_NS for one in ways),
        p50_us=doctor.part(ways, 0.5), p999_us=doctor.part(ways, 0.999),
        max_us=doctor.part(ways, 1.0), real_time=real_time,
    )  # fmt: skip


def _await(
    near: socket.socket, clock: wire.HostTime, came: list[int], number: int, until_ns: int
) -> None:
    """Receive frames until the answer arrives or its time is over."""
    while not came[number] and (left := until_ns - clock.now_ns()) > 0:
        if not select.select([near], [], [], left * 1e-9)[0]:
            return
        frame = near.recv(2048)
        there = clock.now_ns()
        (which,) = _NUMBER.unpack_from(frame, len(_HEAD))
        if which < len(came) and not came[which]:
            came[which] = there


class _Kept(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Stored data for undo."""

    schema: str
    boot: str
    """Boot id; the next boot reverts kernel values and renumbers interrupts."""
    folders: tuple[str, ...]
    """Created folders, outermost first."""
    changes: tuple[doctor.SystemChange, ...]


@dataclass(frozen=True, slots=True)
class Mended:
    """Result of one change."""

    change: doctor.SystemChange
    complaint: str = ""
    """Why it was not applied or reverted; empty on success."""
    failed: bool = False
    """Refused by the system; may be possible later."""


def mend(computer: doctor.Computer, changes: Sequence[doctor.SystemChange]) -> tuple[Mended, ...]:
    """Apply changes; raise StorageError, changing nothing, if undo cannot be stored.

    `undo` can revert each, also after a power cut midway.
    """
    _require_allowed(changes)
    if not changes:
        return ()
    kept = _kept(computer)
    boot = _boot(computer)
    folders = kept.folders + _missing_above(computer, doctor.UNDO_FILE)
    for change in changes:
        if change.kind is doctor.ChangeKind.NEW_FILE:
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


def undo(computer: doctor.Computer) -> tuple[Mended, ...]:
    """Revert all changes, last first; return them in that order.

    Values changed by others since are left alone. InputError if nothing was changed, or the file
    with previous values is damaged; StorageError if this user cannot revert them.
    """
    place = computer.place(doctor.UNDO_FILE)
    if not place.exists():
        raise InputError(
            "doctor.nothing_to_undo", "Nothing was changed by --fix.", "There is nothing to undo."
        )
    kept = _kept(computer)
    changes = kept.changes if kept.boot == _boot(computer) else _lasting(kept.changes)
    if not os.access(place.parent, os.W_OK):
        raise _no_rights(PermissionError(1, tr_later("Operation not permitted")))
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


def can_undo(computer: doctor.Computer) -> bool:
    """Return whether there are changes to revert."""
    return computer.place(doctor.UNDO_FILE).exists()


def may_mend(computer: doctor.Computer) -> bool:
    """Return whether this user may change the computer, by access to the undo file.

    The root folder is no criterion: a station's system is read-only with overlays.
    """
    folder = computer.place(doctor.UNDO_FILE).parent
    while not folder.exists():
        folder = folder.parent
    return os.access(folder, os.W_OK)


def _made(
    computer: doctor.Computer, change: doctor.SystemChange, there: str, wanted: str
) -> Mended:
    try:
        now = _now(computer, change)
        if now == wanted:
            return Mended(change)
        if now != there:
            now = now or tr_later("not there")
            return Mended(change, tr_later(f"it is {now} now; somebody else changed it"))
        _write(computer, change, wanted)
    except doctor.NotAskedError as error:
        return Mended(change, error.what, failed=True)
    except OSError as error:
        return Mended(change, str(error.strerror), failed=True)
    return Mended(change)


def _now(computer: doctor.Computer, change: doctor.SystemChange) -> str:
    if change.kind is doctor.ChangeKind.ADAPTER:
        name, kind, option = change.place.split()
        return doctor.adapter_settings(computer, name, kind).get(option, "")
    if change.kind is doctor.ChangeKind.NEW_FILE:
        return f"{computer.text(change.place)}\n" if computer.has(change.place) else ""
    return computer.text(change.place)


def _write(computer: doctor.Computer, change: doctor.SystemChange, value: str) -> None:
    place = computer.place(change.place)
    if change.kind is doctor.ChangeKind.ADAPTER:
        name, kind, option = change.place.split()
        doctor.change_setting(computer, name, kind, option, value)
    elif change.kind is doctor.ChangeKind.NEW_FILE:
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


def _keep(computer: doctor.Computer, kept: _Kept) -> None:
    content = msgspec.json.format(msgspec.json.encode(kept), indent=1)
    write_atomic(computer.place(doctor.UNDO_FILE), content + b"\n")


def _kept(computer: doctor.Computer) -> _Kept:
    """Return stored undo data; raise InputError if damaged."""
    place = computer.place(doctor.UNDO_FILE)
    if not place.exists():
        return _Kept(schema=_SCHEMA, boot="", folders=(), changes=())
    try:
        kept = msgspec.json.decode(read_bytes(place, _MOST_BYTES), type=_Kept)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _damaged(place) from error
    if kept.schema != _SCHEMA or not all(doctor.is_allowed(one) for one in kept.changes):
        raise _damaged(place)
    if not all(
        any(Path(folder) in Path(file).parents for file in (doctor.UNDO_FILE, doctor.LIMITS))
        for folder in kept.folders
    ):
        raise _damaged(place)
    return kept


def _require_allowed(changes: Sequence[doctor.SystemChange]) -> None:
    for change in changes:
        if not doctor.is_allowed(change):
            raise InternalError(
                "doctor.change",
                f"A check asked for a change that is none of those it may ask for: {change.place}.",
                "Nothing was changed. Report this.",
            )


def _lasting(changes: Sequence[doctor.SystemChange]) -> tuple[doctor.SystemChange, ...]:
    """Return the changes that survive a reboot."""
    return tuple(one for one in changes if one.kind is doctor.ChangeKind.NEW_FILE)


def _boot(computer: doctor.Computer) -> str:
    try:
        return computer.text(_BOOT)
    except doctor.NotAskedError:
        return ""


def _missing_above(computer: doctor.Computer, path: str) -> tuple[str, ...]:
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


if __name__ == "__main__":
    main()
