"""A plan as a TOML document: verified by reading back, released by name, chosen from a folder.

A job contains the plan that it was measured by, and a copy of its release.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core import seals
from ocmm_core.cleanup import scratch_folder
from ocmm_core.documents import text_digest, write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.inspection.plan._findings import require_consistent
from ocmm_core.inspection.plan._plan import Plan, check_plan, load_plan, read_plan
from ocmm_core.inspection.plan._requirements import requirement_count
from ocmm_core.storage import JobEvent, JobFile, JobHead

_TABLES = ("alignment", "material", "environment", "model")
_LISTS = ("features", "constructions", "characteristics", "sources", "requirements")


def save_plan(plan: Plan, path: Path | str) -> None:
    """Write a plan atomically; comments of the old file are lost.

    InputError if it is unmeasurable (nothing is written), StorageError if the file cannot be
    written, or does not hold what was written.
    """
    path = Path(path)
    check_plan(path, plan)
    try:
        write_atomic(path, plan_text(plan).encode("utf-8"))
    except OSError as error:
        raise StorageError(
            "plan.not_written",
            f"{path}: the plan cannot be written ({error.strerror or error}).",
            "Choose a writable folder with enough space.",
        ) from error
    if load_plan(path) != plan:
        raise StorageError(
            "plan.not_same",
            f"{path}: the written plan reads back differently.",
            "Save it under another name, and report this.",
        )


def plan_text(plan: Plan) -> str:
    """Return the document of a plan, without defaults."""
    lines = [
        f"{field} = {_value(getattr(plan, field))}" for field in ("schema", "unit", "name", "part")
    ]
    lists = {name: getattr(plan, name) for name in _LISTS}
    for field in msgspec.structs.fields(plan):
        value = getattr(plan, field.name)
        known = ("schema", "unit", "name", "part", *_TABLES, *_LISTS)
        if field.name not in known and value != field.default:
            lines.append(f"{field.name} = {_value(msgspec.to_builtins(value))}")
    # An empty list has no table of its own.
    lines += [f"{name} = []" for name in ("features", "characteristics") if not lists[name]]
    for name in _TABLES:
        if getattr(plan, name) is not None:
            lines += ["", f"[{name}]", *_entries(getattr(plan, name))]
    for name, items in lists.items():
        for item in items:
            lines += ["", f"[[{name}]]", *_entries(item)]
    return "\n".join(lines) + "\n"


def _entries(item: msgspec.Struct) -> list[str]:
    data = msgspec.to_builtins(item)
    defaults = {field.name: field.default for field in msgspec.structs.fields(item)}
    return [
        f"{key} = {_value(value)}"
        for key, value in data.items()
        if value is not None
        and (key not in defaults or getattr(item, key) != defaults[key])
        and not (isinstance(value, list | tuple) and not value)
    ]


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON does not escape DEL, which TOML requires.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        inner = ", ".join(f"{k} = {_value(v)}" for k, v in value.items() if v is not None)
        return f"{{ {inner} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    return repr(value)


RELEASE_EVENT = "plan release"


class _Copy(msgspec.Struct, frozen=True, omit_defaults=True):
    words: str
    release: seals.Release
    replaced: bool = False


def release_plan(path: Path, who: str, reason: str = "") -> seals.Release:
    """Release a plan by name; errors as `load_plan`, `require_consistent` and `release_file`."""
    require_consistent(path, load_plan(path))
    return seals.release_file(path, seals.Signed.PLAN, who, reason)


def plan_release(path: Path) -> seals.ReleaseState:
    return seals.release_state(path, seals.Signed.PLAN)


def require_released(path: Path, found: seals.ReleaseState) -> None:
    """Raise InputError for a plan that is not released, or was changed afterwards."""
    if not found.released:
        raise InputError(
            "plan.not_released",
            f"{path}: the plan is {found.summary}, and this station measures released plans only.",
            "Have the person who answers for its limits release it: ocmm plan release.",
        )


def note_release(job: JobFile, found: seals.ReleaseState) -> None:
    """Copy the release of the plan into a new job; StorageError if it cannot be stored."""
    if found.release is not None and found.release.signature is not None:
        content = msgspec.json.encode(_Copy(found.summary, found.release, found.replaced))
        job.append_event(RELEASE_EVENT, content.decode())


def release_in_job(head: JobHead, events: Iterable[JobEvent]) -> seals.ReleaseState:
    """Return the state of the release in a job; errors as `judge_release`."""
    texts = [event.text for event in events if event.kind == RELEASE_EVENT]
    if not texts:
        return seals.NO_RELEASE
    try:
        copy = msgspec.json.decode(texts[-1], type=_Copy)
    except (ValueError, RecursionError):
        return seals.NO_RELEASE
    state = seals.judge_release(copy.release, seals.Signed.PLAN, head.plan_identity)
    return replace(state, replaced=copy.replaced)


SUFFIX = ".toml"


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """A plan that can be measured."""

    path: Path
    identity: str
    """`path`, `identity`: Its file, and the SHA-256 of it."""
    name: str
    part: str
    release: seals.ReleaseState = seals.NO_RELEASE
    requirements: str = ""
    """Requirements of its sources in the plan; empty without a source."""

    @property
    def remarks(self) -> tuple[str, ...]:
        return tuple(filter(None, (self.release.summary, self.requirements)))


def plan_card(path: Path) -> PlanSummary:
    """Return the summary of a plan; InputError as `load_plan`."""
    plan, text = read_plan(path)
    count = requirement_count(plan)
    return PlanSummary(
        path.absolute(), text_digest(text), plan.name, plan.part, plan_release(path),
        "" if count is None else count.sentence,
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


def stored_plan(head: JobHead) -> Plan:
    """Return the plan to resume a job by; InputError if of another version and unusable."""
    with scratch_folder("plan") as folder:
        path = folder / "plan_of_the_job.toml"
        path.write_text(head.plan_text, encoding="utf-8")
        return load_plan(path)
