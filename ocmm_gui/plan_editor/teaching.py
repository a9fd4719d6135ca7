"""Nominals from the part of a job file; runs in a process of its own."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.inspection.evaluation import checked_features
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.reopen import reopen_job
from ocmm_core.inspection.teach import taught_plan
from ocmm_core.measuring.temperature import reported_points
from ocmm_gui.maintain.side_process import Tell


def taught_of_file(path: Path, plan: Plan, tell: Tell) -> Plan:
    """Return a plan with the nominals of what a job has measured, in its part frame.

    Raises
    ------
    OcmmError
        The job cannot be read, or its part frame is not measured.
    """
    tell("Reading the job", 0.2)
    job = reopen_job(path)
    tell("Rounding the nominals", 0.8)
    points = reported_points(job.points, job.climate.part)
    actual = checked_features(job.plan, points, job.options)
    return taught_plan(plan, actual, job.T_part_from_world)
