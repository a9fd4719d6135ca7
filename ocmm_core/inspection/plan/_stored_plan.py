"""The plan stored in a job file."""

from __future__ import annotations

from ocmm_core.inspection.plan._plan import Plan, load_plan
from ocmm_core.leftovers import scratch_folder
from ocmm_core.storage import JobHead


def stored_plan(head: JobHead) -> Plan:
    """Return the plan to resume a job by; InputError if of another version and unusable."""
    with scratch_folder("plan") as folder:
        path = folder / "plan_of_the_job.toml"
        path.write_text(head.plan_text, encoding="utf-8")
        return load_plan(path)
