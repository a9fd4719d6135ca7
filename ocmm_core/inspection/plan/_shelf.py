"""Plans of a folder, to choose one."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import digest
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.plan._plan import load_plan
from ocmm_core.inspection.plan._plan_release import plan_release
from ocmm_core.inspection.plan._requirements import requirement_count
from ocmm_core.seals import NO_RELEASE, ReleaseState

SUFFIX = ".toml"


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """A plan that can be measured."""

    path: Path
    identity: str
    """`path`, `identity`: Its file, and the SHA-256 of it."""
    name: str
    part: str
    release: ReleaseState = NO_RELEASE
    requirements: str = ""
    """Requirements of its sources in the plan; empty without a source."""

    @property
    def remarks(self) -> tuple[str, ...]:
        return tuple(filter(None, (self.release.words, self.requirements)))


def plan_card(path: Path) -> PlanSummary:
    """Return the summary of a plan; InputError as `load_plan`."""
    plan = load_plan(path)
    count = requirement_count(plan)
    return PlanSummary(
        path.absolute(), digest(path), plan.name, plan.part, plan_release(path),
        "" if count is None else count.words,
    )  # fmt: skip


def list_plans(folder: Path) -> tuple[PlanSummary, ...]:
    """Return the valid plans of a folder by file name."""
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() == SUFFIX)
    except OSError:
        return ()
    found = []
    for path in files:
        with contextlib.suppress(OcmmError):
            found.append(plan_card(path))
    return tuple(found)
