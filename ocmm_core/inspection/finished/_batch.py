"""Parts of a batch: one job file per part, all by the same plan, in one folder.

Also the recent jobs, and the pose of the previous part of a batch.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.alignment import nominal_frame
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.evaluation import PAUSED, RESUMED, STANDING_EVENT, WrittenProgress
from ocmm_core.inspection.finished._reopen import reopen_job
from ocmm_core.inspection.finished._stored_documents import about
from ocmm_core.inspection.plan import stored_plan
from ocmm_core.inspection.session import NOT_GIVEN, header_of, is_simulated
from ocmm_core.names import normal_name
from ocmm_core.storage import JobSummary, event_value, read_summary

MOST_FILES = 2000
"""Files of a folder whose modification time is read."""


@dataclass(frozen=True, slots=True)
class LastJob:
    """A job in a list."""

    path: Path
    part: str = ""
    serial: str = ""
    operator: str = ""
    """`part`, `serial`, `operator`: Empty if the header cannot be read."""
    points: int = 0
    finished: int = 0
    features: int = 0
    """`finished`, `features`: Features finished or skipped, of all."""
    paused: bool = False
    changed_s: float = 0.0
    """When its file was changed, seconds since 1970."""
    simulated: bool = False
    """Points may come from a virtual rig."""
    fault: OcmmError | None = None
    """Why it cannot be read; None for a sound one."""

    @property
    def complete(self) -> bool:
        return 0 < self.features <= self.finished


def last_jobs(folder: Path, also: Iterable[Path] = (), *, most: int = 20) -> tuple[LastJob, ...]:
    """Return the most recently changed jobs of a folder and of ``also``, newest first.

    At most ``most`` files are opened. Damaged files are listed with their fault.
    """
    found: dict[Path, float] = {}
    for path in (*_in_folder(folder), *also):
        # A file that vanishes meanwhile, or an invalid name.
        with contextlib.suppress(OSError, ValueError):
            found[path.absolute()] = path.stat().st_mtime
    newest = sorted(found, key=lambda path: found[path], reverse=True)[:most]
    return tuple(_read_job(path, found[path]) for path in newest)


def _in_folder(folder: Path) -> list[Path]:
    jobs: list[Path] = []
    try:
        for path in folder.iterdir():
            if path.suffix == SUFFIX:
                jobs.append(path)
            if len(jobs) >= MOST_FILES:
                break
    except OSError:
        return []
    return jobs


def _read_job(path: Path, changed_s: float) -> LastJob:
    try:
        return _job(path, changed_s, read_summary(path))
    except OcmmError as fault:
        return LastJob(path, changed_s=changed_s, fault=fault)


def _job(path: Path, changed_s: float, seen: JobSummary) -> LastJob:
    header = header_of(seen.head, seen.events)
    names = {feature.name for feature in stored_plan(seen.head).features}
    settled: set[str] = set()
    paused = False
    for event in seen.events:
        if event.kind == STANDING_EVENT:
            standing = event_value(STANDING_EVENT, event.text, WrittenProgress)
            settled = {*standing.done, *standing.skipped} & names
        elif event.kind in (PAUSED, RESUMED):
            paused = event.kind == PAUSED
    return LastJob(
        path, header.part, header.serial, header.operator, seen.n_points, len(settled), len(names),
        paused, changed_s, is_simulated(seen.events),
    )  # fmt: skip


def previous_part_pose(
    folder: Path, batch: str, plan_identity: str, rig_identity: str
) -> RigidTransform | None:
    """Return the motion from the world to the nominals by the last part of a batch.

    None without one of the same plan and cameras, for one relative to a reference body, or if its
    frame is unknown. For guidance only: unreadable files are ignored.
    """
    before = [p for p in parts_of_batch(folder, batch) if p.plan_identity == plan_identity]
    if not batch or not before:
        return None
    try:
        job = reopen_job(before[-1].path)
        bound = job.plan.bound_alignment
        frame = job.T_part_from_world
        same = job.options.reference is None and job.rig.identity == rig_identity
        if frame is None or bound is None or not same:
            return None
        return nominal_frame(bound).inverse().compose(frame)
    except OcmmError:
        return None


_LAST_NUMBER = re.compile(r"(\d+)(?!.*\d)")
SUFFIX = ".ocmm"


@dataclass(frozen=True, slots=True)
class BatchPart:
    path: Path
    serial: str
    batch: str
    operator: str
    created_utc: str
    """ISO 8601."""
    plan_identity: str
    """SHA-256."""
    points: int


def parts_of_batch(
    folder: Path, batch: str, passed_over: Callable[[OcmmError], object] = lambda fault: None
) -> tuple[BatchPart, ...]:
    """Return the parts of a batch in a folder, oldest first, also running ones.

    ``passed_over`` gets the fault of each unreadable file: a list must never prevent measuring.
    """
    found, batch = [], normal_name(batch)
    paths: list[Path] = []
    try:
        paths = files_of_folder(folder, SUFFIX)
    except OcmmError as fault:
        passed_over(fault)
    for path in paths:
        try:
            seen = read_summary(path)
            header = header_of(seen.head, seen.events)
        except OcmmError as fault:
            passed_over(about(fault, path))
            continue
        if header.batch == batch:
            found.append(
                BatchPart(
                    path,
                    header.serial,
                    header.batch,
                    header.operator,
                    seen.head.created_utc,
                    seen.head.plan_identity,
                    seen.n_points,
                )
            )
    return tuple(sorted(found, key=lambda part: part.created_utc))


def next_serial(serial: str) -> str:
    """Return the serial number with its last number incremented; InputError without one.

    The part after one without a serial number has none either.
    """
    if serial == NOT_GIVEN:
        return serial
    match = _LAST_NUMBER.search(serial)
    if match is None:
        raise InputError(
            "batch.serial",
            f"{serial!r} has no number to increment.",
            "Give the serial number of every part.",
        )
    digits = match.group(1)
    counted = str(int(digits) + 1).zfill(len(digits))
    return f"{serial[: match.start()]}{counted}{serial[match.end() :]}"


def require_new_serial(
    folder: Path,
    batch: str,
    serial: str,
    passed_over: Callable[[OcmmError], object] = lambda fault: None,
) -> None:
    """Raise InputError if the batch has this serial number: it would count twice in statistics.

    ``passed_over`` gets the faults of unreadable files.
    """
    if not batch or serial == NOT_GIVEN:
        return
    for part in parts_of_batch(folder, batch, passed_over):
        if part.serial == serial:
            raise InputError(
                "batch.repeated",
                f"Serial number {serial} of batch {batch} is already measured: {part.path}.",
                "Give the serial number of this part, or resume that job (Continue).",
            )
