"""Requirements of a model, stored in the plan with their state at the import."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ocmm_core.inspection.drawing._account import Account, AccountItem
from ocmm_core.inspection.plan import Plan, Requirement, source_of, with_requirements
from ocmm_core.inspection.pmi import Dimension, Tolerance
from ocmm_core.inspection.step import StepModel, model_files
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic

_NOMINAL = "nominal of "
_UNITS = {"length": "mm", "angle": "deg"}


def with_account(
    plan: Plan, model: StepModel, account: Account, file: Path, without: str = ""
) -> Plan:
    """Return the plan with the account of its model.

    Parameters
    ----------
    file
        The model.
    without
        Reason for importing features without tolerances, part of a sentence: nothing is in the
        plan then.

    Raises
    ------
    InputError
        The model cannot be read any more.
    """
    if not account.items or model.pmi is None:
        return plan
    sha256 = model_files(file).sha256 if model.part is None else model.part.source_sha256
    named = {one.name: one for one in plan.characteristics}
    drawn = {one.entity: one for one in (*model.pmi.dimensions, *model.pmi.tolerances)}
    notes = {one.entity: one.text for one in model.pmi.annotations}
    found = [
        _requirement(item, named, drawn.get(item.entity), notes.get(item.entity, ""), without)
        for item in account.by_itself()
    ]
    return with_requirements(plan, source_of("model", file, sha256), found)


def _requirement(
    item: AccountItem,
    named: Mapping[str, Characteristic],
    drawn: Dimension | Tolerance | None,
    note: str,
    without: str,
) -> Requirement:
    became = () if without else item.became
    characteristics = [name for name in became if name in named]
    nominals = [name.removeprefix(_NOMINAL) for name in became if name not in named]
    why = item.why or ("it was taken in part" if item.status != "taken" else "")
    numbers = _numbers(drawn)
    if characteristics:
        # General tolerances and fits are limits in the plan only.
        one = named[characteristics[0]]
        numbers = one.nominal, one.lower, one.upper, spec_of(one.kind).unit
    is_note = item.group == "annotation"
    asks = note if is_note and note else item.kind
    return Requirement(
        group="note" if is_note else item.group, label=item.name, asks=asks,
        reference=f"#{item.entity}", nominal=numbers[0], lower=numbers[1], upper=numbers[2],
        unit=numbers[3], characteristics=characteristics, nominals=nominals, why=without or why,
        remark=item.remark,
    )  # fmt: skip


def _numbers(
    one: Dimension | Tolerance | None,
) -> tuple[float | None, float | None, float | None, str]:
    """Return nominal, deviations and unit in the file."""
    if isinstance(one, Dimension):
        return one.nominal, one.lower, one.upper, _UNITS.get(one.of, "")
    if one is None or one.size is None:
        return None, None, None, ""
    return None, 0.0, one.size, "mm"
