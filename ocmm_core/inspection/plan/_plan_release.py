"""Release of a plan by name, and its copy in the jobs measured by the plan."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.inspection.plan._findings import require_consistent
from ocmm_core.inspection.plan._plan import load_plan
from ocmm_core.seals import (
    NO_RELEASE,
    Release,
    ReleaseState,
    Signed,
    judge_release,
    release_file,
    release_state,
)
from ocmm_core.storage import JobEvent, JobFile, JobHead

RELEASE_EVENT = "plan release"


class _Copy(msgspec.Struct, frozen=True):
    words: str
    release: Release


def release_plan(path: Path, who: str, reason: str = "") -> Release:
    """Release a plan by name; errors as `load_plan`, `require_consistent` and `release_file`."""
    require_consistent(path, load_plan(path))
    return release_file(path, Signed.PLAN, who, reason)


def plan_release(path: Path) -> ReleaseState:
    """Return the state of the release of a plan; errors as `release_state`."""
    return release_state(path, Signed.PLAN)


def require_released(path: Path, found: ReleaseState) -> None:
    """Raise InputError for a plan that is not released, or was changed afterwards."""
    if not found.released:
        raise InputError(
            "plan.not_released",
            f"{path}: the plan is {found.words}, and this station measures released plans only.",
            "Have the person who answers for its limits release it: ocmm plan release.",
        )


def note_release(job: JobFile, found: ReleaseState) -> None:
    """Copy the release of the plan into a new job; StorageError if it cannot be stored."""
    if found.release is not None and found.release.signature is not None:
        content = msgspec.json.encode(_Copy(found.words, found.release))
        job.append_event(RELEASE_EVENT, content.decode())


def release_in_job(head: JobHead, events: Iterable[JobEvent]) -> ReleaseState:
    """Return the state of the release in a job; errors as `judge_release`."""
    texts = [event.text for event in events if event.kind == RELEASE_EVENT]
    if not texts:
        return NO_RELEASE
    try:
        release = msgspec.json.decode(texts[-1], type=_Copy).release
    except (ValueError, RecursionError):
        release = None
    return judge_release(release, Signed.PLAN, head.plan_identity)
