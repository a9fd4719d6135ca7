"""The plans that lie in a folder, for whoever chooses one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import digest
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.plan._plan import load_plan

SUFFIX = ".toml"
MOST_FILES = 200


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """A plan that can be measured: its file, the SHA-256 of it, its name and that of the part."""

    path: Path
    identity: str
    name: str
    part: str


def plan_card(path: Path) -> PlanSummary:
    """Return what is to be known of a plan; raise InputError as `load_plan`."""
    plan = load_plan(path)
    return PlanSummary(path.absolute(), digest(path), plan.name, plan.part)


def list_plans(folder: Path) -> tuple[PlanSummary, ...]:
    """Return the plans of a folder by name of file; what is no plan, or a faulty one, is left out.

    No more than `MOST_FILES` files are looked at.
    """
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() == SUFFIX)
    except OSError:
        return ()
    found = []
    for path in files[:MOST_FILES]:
        try:
            found.append(plan_card(path))
        except OcmmError:
            continue
    return tuple(found)
