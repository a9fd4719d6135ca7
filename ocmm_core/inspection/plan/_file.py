"""A plan as a TOML document: verified by reading back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.inspection.plan._plan import Plan, check_plan, load_plan

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
