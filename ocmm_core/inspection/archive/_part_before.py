"""Where the part before this one of a batch stood: the next one mostly stands there, too."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.alignment import nominal_frame
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.archive._batch import parts_of_batch
from ocmm_core.inspection.archive._reopen import reopen_job


def previous_part_pose(
    folder: Path, batch: str, plan_identity: str, rig_identity: str
) -> RigidTransform | None:
    """Return the motion from the world to the nominals by the last part of a batch.

    None where there is no part before, it was measured by another plan, with other cameras or
    relative to a reference body, or its part frame is not known. It is only for guidance: what
    cannot be read is left alone.
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
