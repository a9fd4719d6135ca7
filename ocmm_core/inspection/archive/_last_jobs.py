"""Recent jobs, and the pose of the previous part of a batch."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.alignment import nominal_frame
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.archive._batch import SUFFIX, parts_of_batch
from ocmm_core.inspection.archive._reopen import reopen_job
from ocmm_core.inspection.evaluation import PAUSED, RESUMED, STANDING_EVENT, WrittenProgress
from ocmm_core.inspection.plan import stored_plan
from ocmm_core.inspection.session import header_of, is_simulated
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


def last_jobs(
    folder: Path,
    also: Iterable[Path] = (),
    *,
    most: int = 20,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[LastJob, ...]:
    """Return the most recently changed jobs of a folder and of ``also``, newest first.

    At most ``most`` files are opened. Damaged files are listed with their fault.
    """
    found: dict[Path, float] = {}
    for path in (*_in_folder(folder), *also):
        # A file that vanishes meanwhile, or an invalid name.
        with contextlib.suppress(OSError, ValueError):
            found[path.absolute()] = path.stat().st_mtime
    newest = sorted(found, key=lambda path: found[path], reverse=True)[:most]
    return tuple(_look(path, found[path]) for path in newest if not stopped())


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


def _look(path: Path, changed_s: float) -> LastJob:
    try:
        seen = read_summary(path)
        return _job(path, changed_s, seen)
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
