"""Disk checks: free space, file system, and sync time."""

from __future__ import annotations

import os
import statistics
import time
from pathlib import Path

from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.leftovers import temporary_file

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


def _measure(computer: Computer, folder: Path) -> list[float]:
    """Return the times of synced block writes, s."""
    try:
        descriptor, temporary = temporary_file(folder / "doctor")
    except OSError as error:
        raise NotAskedError(
            f"{folder} cannot be written ({error.strerror}).",
            "Choose a folder for jobs that this user can write: --jobs",
        ) from error
    times = []
    try:
        for _ in range(_WRITES):
            begin = time.perf_counter()
            os.write(descriptor, _BLOCK)
            computer.calls.fsync(descriptor)
            times.append(time.perf_counter() - begin)
    except OSError as error:
        raise NotAskedError(
            f"Writing to {folder} failed ({error.strerror}).",
            "Free some room; a disk with errors is to be replaced.",
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
        os.close(descriptor)
    return times


def _existing(computer: Computer, folder: Path) -> Path:
    for one in (folder, *folder.parents):
        if computer.place(one).is_dir():
            return one
    return Path("/")


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
