"""Checks of disk and records: space and sync time, expiry dates, signing key, program version.

The checks of records read dates only and write nothing, so they are always safe to run; ``ocmm
calibrate status`` reports whether a calibration may be used.
"""

from __future__ import annotations

import os
import stat
import statistics
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version

import msgspec

from ocmm_core import __version__
from ocmm_core.build import build_version
from ocmm_core.calibration.records import PROBE_SCHEMA, SCHEMA, TIP_SCHEMA
from ocmm_core.cleanup import temporary_file
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.seals import KEY_IN_FORCE, key_lost, memory_file, memory_folder

_GIB = 1 << 30
RED_GIB, AMBER_GIB = 0.5, 5.0
"""A job has some megabytes, the session of a calibration 10 MB, a recording of raw frames some
gigabytes an hour."""
AMBER_MS, RED_MS = 25.0, 100.0
"""A point is acknowledged once on disk. A delay of 0.1 s between hand and beep is noticeable
(Miller 1968, Nielsen 1993); a quarter of it leaves room for other delays."""
_WRITES = 60
_BLOCK = b"\0" * 4096
_IN_MEMORY = ("tmpfs", "ramfs", "devtmpfs")


def disk(computer: Computer) -> Answer:
    """Return whether the folders of jobs and records have room and are writable."""
    least, where = float("inf"), computer.data
    for folder in (computer.data, computer.jobs):
        found = _existing(computer, folder)
        try:
            room = computer.calls.statvfs(computer.place(found))
        except OSError as error:
            raise NotAskedError(
                f"The room below {found} is not known ({error.strerror})."
            ) from error
        if room.f_flag & os.ST_RDONLY:
            return red(
                "disk.read_only",
                f"{folder} is on a disk that cannot be written.",
                "Mount it for writing. A disk that changed to this by itself is failing: save it.",
            )
        # A file system without a fixed number of files reports none.
        if room.f_files and not room.f_favail:
            return red(
                "disk.no_files",
                f"The disk of {folder} has room, but for no more files.",
                "Delete or move files.",
            )
        gib = room.f_bavail * room.f_frsize / _GIB
        if gib < least:
            least, where = gib, folder
    figures = {"free_GiB": round(least, 3)}
    if least >= AMBER_GIB:
        return green(f"{least:.0f} GiB free.", **figures)
    what = f"{least:.1f} GiB free for {where}."
    remedy = f"Move old jobs and recordings to another disk until {AMBER_GIB:.0f} GiB are free."
    if least < RED_GIB:
        return red("disk.full", what, remedy, **figures)
    return amber("disk.low", what, remedy, **figures)


def sync(computer: Computer) -> Answer:
    """Return how long it takes until a point is on disk, measured in the job folder."""
    folder = _existing(computer, computer.jobs)
    kind = _file_system(computer, folder)
    if kind in _IN_MEMORY:
        return red(
            "sync.in_memory",
            f"{computer.jobs} is kept in memory ({kind}): a power cut loses all jobs.",
            "Use a folder on a disk: --jobs, and --out of ocmm measure.",
        )
    times = sorted(1e3 * one for one in _measure(computer, computer.place(folder)))
    middle, late = statistics.median(times), times[int(0.95 * len(times))]
    figures = {"p50_ms": round(middle, 3), "p95_ms": round(late, 3), "max_ms": round(times[-1], 3)}
    what = (
        f"A point is on the disk after {middle:.1f} ms in the median, 95 % within {late:.1f} ms, "
        f"worst of {_WRITES}: {times[-1]:.1f} ms."
    )
    if late <= AMBER_MS:
        return green(what, **figures)
    remedy = (
        "Use a solid-state disk in this computer for jobs, not a network folder or a USB stick."
    )
    if late <= RED_MS:
        return amber("sync.slow", what, remedy, **figures)
    return red("sync.very_slow", what, remedy, **figures)


def _measure(computer: Computer, folder: Path) -> Iterator[float]:
    """Yield the times of synced block writes, s."""
    try:
        descriptor, temporary = temporary_file(folder / "doctor")
    except OSError as error:
        raise NotAskedError(
            f"{folder} cannot be written ({error.strerror}).",
            "Choose a folder for jobs that this user can write: --jobs",
        ) from error
    try:
        for _ in range(_WRITES):
            begin = time.perf_counter()
            os.write(descriptor, _BLOCK)
            computer.calls.fsync(descriptor)
            yield time.perf_counter() - begin
    except OSError as error:
        raise NotAskedError(
            f"Writing to {folder} failed ({error.strerror}).",
            "Free some room; a disk with errors is to be replaced.",
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
        os.close(descriptor)


def _existing(computer: Computer, folder: Path) -> Path:
    found = (one for one in (folder, *folder.parents) if computer.place(one).is_dir())
    return next(found, Path("/"))


def _file_system(computer: Computer, folder: Path) -> str:
    """Return the file system type of a folder; empty if unknown."""
    best, kind = "", ""
    for line in computer.text("/proc/self/mounts").splitlines():
        fields = line.split()
        if len(fields) < 3:
            continue
        mounted = fields[1]
        inside = mounted == "/" or f"{folder}/".startswith(f"{mounted}/")
        if inside and len(mounted) >= len(best):
            best, kind = mounted, fields[2]
    return kind


DUE_BEFORE = timedelta(days=14)
"""As in the records: DUE within this time before the end."""
_HASH_DIGITS = 64
_LARGEST = 8 << 20
_WORDS = {
    SCHEMA: "The calibration of the cameras of",
    PROBE_SCHEMA: "The calibration of the probe of",
    TIP_SCHEMA: "The qualification of the tip of",
}


class _Artefact(msgspec.Struct, frozen=True):
    name: str
    serial: str
    due_utc: str


class _Dates(msgspec.Struct, frozen=True):
    schema: str
    made_utc: str
    valid_until_utc: str = ""
    tip: str = ""
    artefacts: tuple[_Artefact, ...] = ()


class _File(msgspec.Struct, frozen=True):
    content: _Dates


def calibrations(computer: Computer) -> Answer:
    """Return the expiry of the latest calibrations of all rigs and probes."""
    ends = [
        (_moment(one.valid_until_utc), f"{_WORDS[one.schema]} '{name}'")
        for name, one in _newest(computer)
        if one.schema in _WORDS
    ]
    if not ends:
        return amber(
            "calibrations.none",
            f"No calibration of real cameras is stored for {computer.user}.",
            "Calibrate: ocmm calibrate cameras, then ocmm calibrate probe.",
        )
    until, what = min(ends)
    expired = red(
        "calibrations.expired", f"{what} expired on {until:%Y-%m-%d}.",
        "Calibrate again; until then every verdict is NOT PROVEN.",
    )  # fmt: skip
    due = amber(
        "calibrations.due", f"{what} ends on {until:%Y-%m-%d}.", "Calibrate before that day."
    )
    return _by_date(computer, until, expired, due, len(ends))


def certificates(computer: Computer) -> Answer:
    """Return the expiry of the certificates of artefacts used by the calibrations."""
    newest: dict[tuple[str, str], datetime] = {}
    for _, record in _newest(computer):
        for one in record.artefacts:
            key = one.name, one.serial
            # After a recalibration the later certificate counts.
            newest[key] = max(newest.get(key, _moment(one.due_utc)), _moment(one.due_utc))
    if not newest:
        raise NotAskedError(
            "No stored calibration names an artefact with a certificate.",
            "Calibrate with a certified artefact.",
        )
    (name, serial), until = min(newest.items(), key=lambda one: one[1])
    what = f"The certificate of '{name}' (serial {serial})"
    expired = red(
        "certificates.expired", f"{what} expired on {until:%Y-%m-%d}.",
        "Have it calibrated: no calibration or verification with it is accepted.",
    )  # fmt: skip
    due = amber(
        "certificates.due", f"{what} ends on {until:%Y-%m-%d}.", "Send it to be calibrated."
    )
    return _by_date(computer, until, expired, due, len(newest))


def key(computer: Computer) -> Answer:
    """Return whether the station has a key unreadable by others."""
    folder = computer.data / "keys"
    # A key in a token takes precedence over one in a file, see `seals`.
    in_token = computer.place(folder / "token.json").exists()
    path = folder / ("token.json" if in_token else "station.key")
    try:
        found = computer.place(path).lstat()
        around = computer.place(path.parent).stat()
    except FileNotFoundError:
        memory = computer.state / memory_folder().name / memory_file(KEY_IN_FORCE).name
        if computer.has(memory):
            lost = key_lost(folder)
            return red(lost.code, lost.what, lost.remedy)
        return amber(
            "key.missing",
            f"{computer.user} has no station key yet; the first record or job makes it.",
            "Make it now: ocmm key show",
        )
    except OSError as error:
        raise NotAskedError(f"{path} cannot be looked at ({error.strerror}).") from error
    if not stat.S_ISREG(found.st_mode):
        return red("key.no_file", f"{path} is no file.", "Restore it from a backup.")
    # Not repaired by --fix: an exposed key may have been copied.
    if found.st_mode & 0o077:
        return red(
            "key.readable",
            f"Other users can read the key of this station (mode {found.st_mode & 0o777:04o}).",
            f"Type chmod 600 {path}, then replace the key: ocmm key replace",
        )
    if around.st_mode & 0o022:
        return red(
            "key.folder",
            f"Other users can exchange the key of this station ({path.parent}, mode "
            f"{around.st_mode & 0o777:04o}).",
            f"Type chmod 700 {path.parent}, then compare the key: ocmm key show",
        )
    return green(
        "In a token, and nobody else can read its PIN."
        if in_token
        else "Present, and nobody else can read it."
    )


def program(computer: Computer) -> Answer:
    """Return the running build, and whether all files belong to its version."""
    try:
        installed = version("ocmm").partition("+")[0]
    except PackageNotFoundError:
        installed = __version__
    if installed != __version__:
        return red(
            "program.mixed",
            f"The program files are of version {__version__}, the installation of {installed}.",
            "Install OCMM again; an upgrade was not finished.",
        )
    return green(f"OCMM {build_version()}, Python {python_version()}.")


def _by_date(
    computer: Computer, until: datetime, expired: Answer, due: Answer, count: int
) -> Answer:
    """Return the answer for objects of which the first expires at `until`."""
    now = computer.calls.now()
    if now >= until:
        return expired
    if now >= until - DUE_BEFORE:
        return due
    return green(f"{count} in force, the first one until {until:%Y-%m-%d}.")


def _newest(computer: Computer) -> list[tuple[str, _Dates]]:
    """Return the newest record of each rig, probe and tip, with its folder name."""
    newest: dict[tuple[str, str, str], _Dates] = {}
    for name, record in _records(computer):
        key_ = name, record.schema, record.tip
        before = newest.get(key_)
        if before is None or _moment(before.made_utc) < _moment(record.made_utc):
            newest[key_] = record
    return [(name, record) for (name, _, _), record in newest.items()]


def _records(computer: Computer) -> Iterator[tuple[str, _Dates]]:
    for kind in ("calibrations", "probes"):
        above = computer.data / kind
        if not computer.has(above):
            continue
        for name in computer.names(above):
            folder = above / name
            if not computer.place(folder).is_dir():
                continue
            files = [
                one for one in computer.names(folder)
                if one.endswith(".json") and len(one) == _HASH_DIGITS + len(".json")
            ]  # fmt: skip
            for file in files:
                yield name, _read(computer, folder / file)


def _read(computer: Computer, path: Path) -> _Dates:
    try:
        return msgspec.json.decode(read_bytes(computer.place(path), _LARGEST), type=_File).content
    except (InputError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise NotAskedError(
            f"The record {path.name[:12]} of '{path.parent.name}' cannot be read.",
            "Restore it from a backup; ocmm audit verify says what else is wrong.",
        ) from error


def _moment(text: str) -> datetime:
    try:
        when = datetime.fromisoformat(text)
    except ValueError as error:
        raise NotAskedError(
            f"A record holds no date where one should be ({text[:40]!r})."
        ) from error
    return when if when.tzinfo else when.replace(tzinfo=UTC)
