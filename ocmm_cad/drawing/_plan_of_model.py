"""A plan with the tolerances of a model, and the account of all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import msgspec

from ocmm_cad.drawing._context import NOTE, Account, AccountItem, Context, Group, Status, Surfaces
from ocmm_cad.drawing._frames import DatumFrames
from ocmm_cad.drawing._sizes import Sizes, general_of
from ocmm_cad.drawing._zones import Zones
from ocmm_cad.pmi import Annotation, Datum, DatumTarget, Dimension, Pmi, Tolerance
from ocmm_cad.step import StepModel, model_files
from ocmm_core.inspection.plan import EDITED as A_PLAN
from ocmm_core.inspection.plan import Plan, Requirement, check_plan, source_of, with_requirements
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic

_NOMINAL = "nominal of "
_UNITS = {"length": "mm", "angle": "deg"}


def with_account(
    plan: Plan, model: StepModel, account: Account, file: Path, without: str = ""
) -> Plan:
    """Return the plan with the account of its model; InputError if it is not readable any more.

    ``without``: why features have no tolerances, part of a sentence; no item is then in the plan.
    """
    if not account.items or model.pmi is None:
        return plan
    sha256 = model_files(file).sha256 if model.part is None else model.part.source_sha256
    named = {one.name: one for one in plan.characteristics}
    drawn: dict[int, Dimension | Tolerance] = {one.entity: one for one in model.pmi.dimensions}
    drawn |= {one.entity: one for one in model.pmi.tolerances}
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
    if isinstance(one, Dimension):
        return one.nominal, one.lower, one.upper, _UNITS.get(one.of, "")
    if one is None or one.size is None:
        return None, None, None, ""
    return None, 0.0, one.size, "mm"


_MEANING = (
    "Sizes are those of the associated elements, as the report says (least squares); neither the "
    "envelope (E of ISO 14405-1, Rule #1 of ASME Y14.5) nor two-point sizes are checked by them."
)
_LONGEST_NOTE = 120
_Named: TypeAlias = Dimension | Tolerance | Datum | DatumTarget | Annotation


def plan_with_tolerances(plan: Plan, model: StepModel, general: str = "") -> tuple[Plan, Account]:
    """Return a plan with the tolerances of its model.

    ``plan``: with features of the model. ``general``: tolerance for sizes and distances without
    their own, a word of `CLASSES` or empty; InputError if unknown. The plan gets characteristics,
    and an alignment if it had none and a datum system holds it. The account has all items of the
    model, each imported or refused with its reason.
    """
    asked = general_of(general)
    pmi = model.pmi
    if pmi is None or (pmi.is_empty and not pmi.fault):
        return plan, Account(remarks=("The model says nothing of tolerances.",))
    if pmi.fault:
        return plan, _all_refused(pmi)
    context = Context(plan, Surfaces(model, {feature.name: feature for feature in plan.features}))
    frames = DatumFrames(context, pmi.datums, pmi.targets)
    aligned = frames.align(pmi.tolerances)
    sizes = Sizes(context, asked)
    items = [sizes.import_item(item) for item in pmi.dimensions]
    zones = Zones(context, frames, sizes, pmi.tolerances)
    for tolerance in pmi.tolerances:
        taken = zones.import_item(tolerance)
        items.append(taken)
        items += _references(tolerance, taken, pmi)
    items += frames.account()
    items += _annotations(pmi, items)
    check_plan(A_PLAN, context.plan)
    remarks = [aligned, _MEANING, *_standards(pmi)]
    if asked is not None:
        remarks.append(
            f"{asked.words} was asked for: it stands for sizes and distances of the model without "
            "a tolerance of their own, and for nothing that the model does not dimension."
        )
    return context.plan, Account(items=_with_notes(items, pmi), remarks=tuple(remarks))


def _all_refused(pmi: Pmi) -> Account:
    why = f"nothing of the model's tolerances can be used: {pmi.fault}"
    groups: tuple[tuple[Group, Sequence[_Named]], ...] = (
        ("dimension", pmi.dimensions), ("tolerance", pmi.tolerances), ("datum", pmi.datums),
        ("datum target", pmi.targets), ("annotation", pmi.annotations),
    )  # fmt: skip
    found = [
        AccountItem(
            group=group, name=item.name, kind=group, entity=item.entity, status="refused", why=why
        )
        for group, items in groups
        for item in items
    ]  # fmt: skip
    if not pmi.dimensions and not pmi.tolerances:
        # So that at least one requirement of the model is counted as missing.
        found.append(
            AccountItem(
                group="general", name="all", kind="tolerances of the model", entity=0,
                status="refused", why=why,
            )
        )  # fmt: skip
    return Account(items=tuple(found))


def _references(tolerance: Tolerance, taken: AccountItem, pmi: Pmi) -> Iterator[AccountItem]:
    """Yield the datum references of a tolerance; for a datum with targets, each target."""
    targets = {datum.name: datum.targets for datum in pmi.datums}
    for place, reference in enumerate(tolerance.datums, start=1):
        label = "-".join(reference.labels)
        modifiers = "".join(f" ({word})" for word in reference.modifiers)
        for target in targets.get(label, ()) or ("",):
            through = f" through {target}" if target else ""
            yield AccountItem(
                group="datum reference", name=f"{label}{through}",
                kind=f"datum {place} of {tolerance.name}{modifiers}", entity=tolerance.entity,
                status="refused" if taken.status == "refused" else "taken",
                became=taken.became,
                why=taken.why if taken.status == "refused" else "",
            )  # fmt: skip


def _annotations(pmi: Pmi, items: Sequence[AccountItem]) -> list[AccountItem]:
    by_entity: dict[int, AccountItem] = {}
    for item in items:
        by_entity.setdefault(item.entity, item)
    labels = {label: datum for datum in pmi.datums for label in datum.labels}
    by_name = {item.name: item for item in items if item.group == "datum"}
    return [_annotation(one, by_entity, labels, by_name) for one in pmi.annotations]


def _annotation(
    one: Annotation,
    by_entity: Mapping[int, AccountItem],
    labels: Mapping[str, object],
    by_name: Mapping[str, AccountItem],
) -> AccountItem:
    if not one.shows:
        text = one.text if len(one.text) <= _LONGEST_NOTE else one.text[:_LONGEST_NOTE] + "…"
        return AccountItem(
            group="annotation", name=one.name, kind=NOTE, entity=one.entity, status="refused",
            why=one.fault or (f"a note is for people: {text}" if text else "a note without text"),
        )  # fmt: skip
    shown = next((by_entity[number] for number in one.shows if number in by_entity), None)
    if shown is None:
        shown = by_name.get(getattr(labels.get(one.name), "name", ""))
    status: Status = "refused" if shown is None else shown.status
    why = "what it shows is not among the items of the file" if shown is None else shown.why
    return AccountItem(
        group="annotation", name=one.name, kind=f"label of {shown.kind if shown else 'an item'}",
        entity=one.entity, status=status, became=shown.became if shown else (), why=why,
    )  # fmt: skip


def _with_notes(items: Sequence[AccountItem], pmi: Pmi) -> tuple[AccountItem, ...]:
    """Return items with the notes on their faces: a note may change their meaning."""
    notes = [one for one in pmi.annotations if not one.shows and one.faces]
    faces = {one.entity: set(one.faces) for one in pmi.dimensions}
    faces |= {one.entity: set(one.faces) for one in pmi.tolerances}
    found = []
    for item in items:
        on = faces.get(item.entity, set()) if item.group in ("dimension", "tolerance") else set()
        said = [
            f"the note {note.name} stands on its faces" + (f": {note.text}" if note.text else "")
            for note in notes
            if item.status != "refused" and on & set(note.faces)
        ]
        remark = "; ".join(filter(None, (item.remark, *said)))
        found.append(msgspec.structs.replace(item, remark=remark))
    return tuple(found)


def _standards(pmi: Pmi) -> list[str]:
    if not pmi.standards:
        return [
            "The model names no standard of tolerancing; zones and datums are taken as ISO 1101 "
            "and ISO 5459 say."
        ]
    named = ", ".join(pmi.standards)
    asme = any("ASME" in word for word in pmi.standards)
    said = f"The model names {named}."
    if asme:
        said += (
            " Zones and datums are evaluated as ISO 1101 and ISO 5459 say, which is the same for "
            "what was taken; what ASME means by another rule was refused."
        )
    return [said]
