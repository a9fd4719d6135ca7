"""What the items of a plan are made of, for the forms of the editor."""

from __future__ import annotations

from typing import get_args

import msgspec

from ocmm_core.alignment.datums import DatumAlignment
from ocmm_core.errors import InputError
from ocmm_core.features.nominal import CRITERIA
from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring.compensation import METHODS
from ocmm_core.tolerances.characteristic import Association
from ocmm_core.tolerances.characteristic import Kind as CharacteristicKind
from ocmm_core.tolerances.decision import RULES
from ocmm_gui.plan_editor.item_form import FormLine, Kind

FEATURE_LINES = (
    FormLine("name", "Name", "Letters, digits, spaces, _ . -"),
    FormLine("shape", "Shape", "What is probed", Kind.CHOICE, tuple(s.value for s in Shape)),
    FormLine("points", "Points", "Touches to take", Kind.COUNT),
    FormLine("side", "Side", "Where the probe stands: outer for shafts and faces, inner for bores",
             Kind.CHOICE, ("outer", "inner")),
    FormLine("point", "Point, mm", "Centre or a point on it, part frame: x y z", Kind.VECTOR),
    FormLine("direction", "Direction", "Normal or axis, part frame: x y z", Kind.VECTOR),
    FormLine("diameter", "Diameter, mm", "Of round shapes; else 0", Kind.NUMBER),
    FormLine("length", "Length, mm", "Of slots and rectangles; of others where known, else 0",
             Kind.NUMBER),
    FormLine("width", "Width, mm", "Of slots and rectangles, tube of a torus; else 0",
             Kind.NUMBER),
    FormLine("angle_deg", "Apex angle, °", "Full angle of a cone; else 0", Kind.NUMBER),
    FormLine("across", "Along", "Direction of the length, part frame: x y z", Kind.VECTOR),
    FormLine("criterion", "Association", "How the element is found from its points", Kind.CHOICE,
             tuple(CRITERIA)),
    FormLine("projection", "Projected on", "Name of a plane; for circles and slots, or empty"),
    FormLine("compensation", "Side found by", "Empty: as the plan says", Kind.CHOICE,
             ("", *METHODS)),
    FormLine("text", "Instruction", "What the inspector reads at this step"),
    FormLine("picture", "Picture", "File beside the plan that he sees, e.g. bore.png"),
)  # fmt: skip

CHARACTERISTIC_LINES = (
    FormLine("name", "Name", "Letters, digits, spaces, _ . -"),
    FormLine("kind", "Kind", "What is toleranced", Kind.CHOICE, get_args(CharacteristicKind)),
    FormLine("features", "Features", "Names with commas between them", Kind.NAMES),
    FormLine("datums", "Datums", "Names in their precedence, with commas between them; or empty",
             Kind.NAMES),
    FormLine("nominal", "Nominal", "mm, or degrees for angles; 0 for zones", Kind.NUMBER),
    FormLine("lower", "Lower limit", "Of the deviation; 0 for zones", Kind.NUMBER),
    FormLine("upper", "Upper limit", "Of the deviation; the tolerance of a zone", Kind.NUMBER),
    FormLine("axis", "Axis", "Of coordinates and distances", Kind.CHOICE, ("", "x", "y", "z")),
    FormLine("association", "Association", "Empty: what is usual for the kind", Kind.CHOICE,
             get_args(Association)),
    FormLine("zone", "Zone", "Of position and orientation; empty: what is usual", Kind.CHOICE,
             ("", "planes", "cylinder", "sphere")),
    FormLine("modifier", "Modifier", "Widens a position by what the size is off its limit",
             Kind.CHOICE, ("", "maximum material", "least material")),
    FormLine("material_size", "Limit size, mm", "That the modifier counts from; else 0",
             Kind.NUMBER),
    FormLine("length", "Length, mm", "Toleranced length of an axis; 0: what was probed",
             Kind.NUMBER),
    FormLine("offset", "Offset, mm", "Of a profile's zone; else 0", Kind.NUMBER),
    FormLine("at", "At, mm", "Height of the diameter of a cone; else 0", Kind.NUMBER),
)  # fmt: skip


class PlanHead(msgspec.Struct, frozen=True, kw_only=True):
    """What a plan says besides its lists; of its alignments the usual one."""

    name: str
    part: str
    rule: str
    compensation: str
    primary: str = ""
    secondary: list[str] = []
    origin: str = ""


HEAD_LINES = (
    FormLine("name", "Plan", "Its name; files are called after it"),
    FormLine("part", "Part", "Name of the part"),
    FormLine("rule", "Decision rule", "How verdicts are made", Kind.CHOICE, tuple(RULES)),
    FormLine("compensation", "Side found by", "How the side of the material is found",
             Kind.CHOICE, METHODS),
    FormLine("primary", "Datum: z", "Plane whose normal, or axis, is z of the part; or empty"),
    FormLine("secondary", "Datum: x", "Two centres, or one line, with a comma between them",
             Kind.NAMES),
    FormLine("origin", "Datum: origin", "Feature whose centre is the origin"),
)  # fmt: skip


def head_of(plan: Plan) -> PlanHead:
    """Return what a plan says besides its lists."""
    rule = plan.alignment
    usual = rule if isinstance(rule, DatumAlignment) else None
    return PlanHead(
        name=plan.name,
        part=plan.part,
        rule=plan.rule,
        compensation=plan.compensation,
        primary="" if usual is None else usual.primary,
        secondary=[] if usual is None else list(usual.secondary),
        origin="" if usual is None else usual.origin,
    )


def with_head(plan: Plan, head: PlanHead) -> Plan:
    """Return the plan with what its head says; an alignment of another kind stays as it is.

    Raises
    ------
    InputError
        The alignment is filled in by half.
    """
    alignment = plan.alignment
    given = (bool(head.primary), bool(head.secondary), bool(head.origin))
    if any(given) and not all(given):
        raise InputError(
            "plan.form.primary",
            "The alignment is filled in by half.",
            "Give all three datums, or none.",
        )
    if all(given):
        keep = alignment if isinstance(alignment, DatumAlignment) else None
        changes = {
            "primary": head.primary,
            "secondary": tuple(head.secondary),
            "origin": head.origin,
        }
        alignment = (
            DatumAlignment(
                primary=head.primary, secondary=tuple(head.secondary), origin=head.origin
            )
            if keep is None
            else msgspec.structs.replace(keep, **changes)
        )
    elif isinstance(alignment, DatumAlignment):
        alignment = None
    data = msgspec.to_builtins(plan) | {
        "name": head.name,
        "part": head.part,
        "rule": head.rule,
        "compensation": head.compensation,
        "alignment": msgspec.to_builtins(alignment),
    }
    return msgspec.convert(data, Plan)
