"""Plans of gauge studies: randomised and blind.

Every measurement has a code, which is the serial number of its job: operators see neither part nor
trial. The order is random for each operator and trial, against drift and memory.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.documents import Document, load_document, write_new
from ocmm_core.errors import InputError, StorageError
from ocmm_core.names import label_fault
from ocmm_shop.studies._gauge_rr import LEAST_OPERATORS, LEAST_PARTS, LEAST_TRIALS

STUDY_SCHEMA = "ocmm.msa-plan/1"
_MOST = 10_000


class StudyRun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One measurement: its code and meaning; trials count from 1."""

    code: str
    part: str
    operator: str
    trial: int


class StudyPlan(Document, frozen=True, kw_only=True):
    """A plan, in the order of measurement."""

    name: str
    """Of the study; the batch of its jobs."""
    seed: int
    runs: tuple[StudyRun, ...]

    @property
    def parts(self) -> tuple[str, ...]:
        return tuple(sorted({one.part for one in self.runs}))

    @property
    def operators(self) -> tuple[str, ...]:
        return tuple(sorted({one.operator for one in self.runs}))

    @property
    def trials(self) -> int:
        """Return the number of measurements per operator and part."""
        return max(one.trial for one in self.runs)


def plan_study(
    name: str, parts: Sequence[str], operators: Sequence[str], trials: int, seed: int
) -> StudyPlan:
    """Return a crossed plan in random order with blind codes; InputError if unsuitable."""
    if len(set(parts)) != len(parts) or len(set(operators)) != len(operators):
        raise InputError(
            "msa.twice", "A part or an operator is named twice.", "Name each of them once."
        )
    count = len(parts) * len(operators) * trials
    if len(parts) < LEAST_PARTS or len(operators) < LEAST_OPERATORS or trials < LEAST_TRIALS:
        raise InputError(
            "msa.too_small",
            f"{len(parts)} parts, {len(operators)} operators and {trials} trials were asked for; "
            f"{LEAST_PARTS}, {LEAST_OPERATORS} and {LEAST_TRIALS} are the least.",
            "10 parts, 3 operators and 3 trials are usual.",
        )
    if count > _MOST:
        raise InputError("msa.too_large", f"{count} measurements.", f"At most {_MOST}.")
    for word in (name, *parts, *operators):
        if fault := label_fault(word):
            raise InputError("msa.name", f"The name {word!r} {fault}.", "Correct the name.")
    rng = np.random.default_rng([seed, 12])
    runs: list[StudyRun] = []
    codes = rng.permutation(count) + 1
    for trial in range(1, trials + 1):
        for operator in (operators[int(i)] for i in rng.permutation(len(operators))):
            for part in (parts[int(i)] for i in rng.permutation(len(parts))):
                code = f"{name}-{int(codes[len(runs)]):0{len(str(count))}}"
                runs.append(StudyRun(code=code, part=part, operator=operator, trial=trial))
    return StudyPlan(schema=STUDY_SCHEMA, unit="mm", name=name, seed=seed, runs=tuple(runs))


def plan_text(plan: StudyPlan) -> str:
    head = {field: getattr(plan, field) for field in ("schema", "unit", "name", "seed")}
    runs = [f"[[runs]]\n{_entries(msgspec.to_builtins(one))}" for one in plan.runs]
    return "\n".join([_entries(head), *runs])


def _entries(values: Mapping[str, object]) -> str:
    # JSON and TOML write text and integers alike.
    return "".join(
        f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items()
    )


def store_plan(path: Path, plan: StudyPlan) -> None:
    """Write a plan to a new file; InputError: it exists; StorageError: it cannot be written."""
    try:
        write_new(path, plan_text(plan).encode("utf-8"))
    except FileExistsError as error:
        raise InputError("msa.exists", f"{path}: the file exists.", "Give another name.") from error
    except OSError as error:
        raise StorageError(
            "msa.store", f"{path}: the plan cannot be written ({error.strerror}).",
            "Give a folder that can be written.",
        ) from error  # fmt: skip


def load_study(path: Path | str) -> StudyPlan:
    """Return a plan; InputError if it is not crossed and balanced, or a code is repeated."""
    plan = load_document(path, StudyPlan, STUDY_SCHEMA)
    require_balanced(plan, str(path))
    return plan


def require_balanced(plan: StudyPlan, where: str) -> None:
    """Raise InputError if a part, operator and trial is missing or repeated."""
    wanted = [
        (part, operator, trial)
        for part in plan.parts
        for operator in plan.operators
        for trial in range(1, plan.trials + 1)
    ]
    found = [(one.part, one.operator, one.trial) for one in plan.runs]
    codes = {one.code for one in plan.runs}
    if sorted(found) != sorted(wanted) or len(codes) != len(found):
        missing = sorted(set(wanted) - set(found))
        what = f"{missing[0]} is missing" if missing else "a measurement or a code is there twice"
        raise InputError(
            "msa.unbalanced",
            f"{where}: the study is not balanced: {what}.",
            "Every operator measures every part equally often; plan it again.",
        )
