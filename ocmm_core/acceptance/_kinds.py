"""Kinds of tests: requirements, planning, judging and retests, one entry each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgspec
import numpy as np

from ocmm_core.acceptance import _evaluating as evaluate
from ocmm_core.acceptance import _planning as plan
from ocmm_core.acceptance import _procedure as procedure
from ocmm_core.acceptance import _result as result
from ocmm_core.acceptance._placement import missing_corners, missing_octants
from ocmm_core.acceptance._situation import Situation, Stage, worst_of
from ocmm_core.errors import CalibrationError, InputError

Retest: TypeAlias = tuple[result.PlannedPosition, ...]


@dataclass(frozen=True, slots=True)
class TestKind:
    __test__ = False

    roles: tuple[str, ...]
    quantities: tuple[str, ...]
    """Quantities whose limits the procedure must state."""
    plan: Callable[[Stage, Any], plan.Planned]
    """All positions, before the first point."""
    values: Callable[[Situation], Iterator[result.JudgedValue]]
    """All judged values of complete positions."""
    retest: Callable[[Situation], Retest]
    """Positions that may be repeated; raises CalibrationError if none may."""
    open_end: Callable[[Situation, Any], str] = lambda _at, _numbers: ""
    """Missing items when all positions are complete; empty if none."""
    shuffled: bool = True


def _whole(at: Situation) -> Retest:
    """Repeat the whole test."""
    if (
        worst_of([one.verdict for one in values_of(at) if not one.superseded])
        is result.AcceptanceVerdict.PASS
    ):
        raise _refused("nothing failed")
    roots = [i for i, one in enumerate(at.plan) if one.retest_of < 0]
    last = {at.root(i): i for i in range(len(at.plan))}
    return tuple(_again(at.plan[one], last[one]) for one in roots)


def _line(at: Situation) -> Retest:
    """Repeat the one line that failed (VDI/VDE 2634 part 1)."""
    bad = sorted(
        {
            int(one.key.split("/")[0])
            for one in values_of(at)
            if not one.superseded and one.verdict is not result.AcceptanceVerdict.PASS
        }
    )
    if not bad:
        raise _refused("nothing failed")
    if len(bad) > 1:
        names = ", ".join(f"'{at.plan[one].name}'" for one in bad)
        raise _refused(f"{len(bad)} lines failed ({names}), and one may be repeated")
    last = max(i for i in range(len(at.plan)) if at.root(i) == bad[0])
    return (_again(at.plan[bad[0]], last),)


def _sets(at: Situation) -> Retest:
    """Repeat sets of which one of three values is outside (ISO 10360-2)."""
    numbers = at.stage.procedure.test
    if not isinstance(numbers, procedure.E0Test):
        raise _refused("it is another kind of test")
    outside: dict[str, int] = {}
    for one in values_of(at):
        if one.superseded or one.verdict is result.AcceptanceVerdict.PASS:
            continue
        if one.quantity == "R0":
            raise _refused(f"R0 of '{one.position}', {one.name}, is outside")
        outside[one.key] = outside.get(one.key, 0) + 1
    if not outside:
        raise _refused("nothing failed")
    if max(outside.values()) > 1:
        raise _refused("more than one value of a set is outside")
    if len(outside) > numbers.sets_outside:
        raise _refused(f"{len(outside)} sets have a value outside, and {numbers.sets_outside} may")
    again = []
    for key in outside:
        position, item = (int(one) for one in key.split("/"))
        root = at.plan[position]
        if root.role == "gauge block":
            repeats = numbers.retest_repeats
            again.append(msgspec.structs.replace(_again(root, position), repeats=repeats))
            continue
        ends = (root.points_world[0], root.points_world[1 + root.items.index(item)])
        again.append(
            msgspec.structs.replace(
                _again(root, position),
                points_world=ends,
                items=(item,),
                repeats=numbers.retest_repeats,
            )
        )
    return tuple(again)


def _again(position: result.PlannedPosition, index: int) -> result.PlannedPosition:
    return msgspec.structs.replace(
        position, name=f"{position.name.removesuffix(', again')}, again", retest_of=index
    )


def _refused(why: str) -> CalibrationError:
    return CalibrationError(
        "acceptance.retest",
        f"A retest is refused: {why}.",
        "Finish the test with this result, or find the cause and begin a new one.",
    )


KINDS: dict[type[msgspec.Struct], TestKind] = {
    procedure.LengthTest: TestKind(
        ("bar",), ("E",), plan.plan_length, evaluate.length_values, _line, missing_corners
    ),
    procedure.SphereTest: TestKind(
        ("sphere",), ("P_Form", "P_Size"), plan.plan_sphere, evaluate.sphere_results, _whole
    ),
    procedure.LocationTest: TestKind(
        ("sphere",), ("L_Dia",), plan.plan_location, evaluate.location_results, _whole
    ),
    procedure.E0Test: TestKind(("bar",), ("E", "R0"), plan.plan_e0, evaluate.e0_values, _sets),
    procedure.E0BlockTest: TestKind(
        ("bar", "gauge block"), ("E", "R0"), plan.plan_e0_blocks, evaluate.e0_values, _sets
    ),
    procedure.LongStylusTest: TestKind(
        ("bar",), ("E_L", "R0"), plan.plan_long_stylus, evaluate.e0_values, _sets
    ),
    procedure.SpatTest: TestKind(
        (), ("SPAT_max", "SPAT_2s"), plan.plan_spat, evaluate.spat_results, _whole
    ),
    procedure.VolumetricTest: TestKind(
        ("bar",), ("V_max", "V_range", "V_2RMS"), plan.plan_volumetric,
        evaluate.volumetric_results, _whole, missing_octants,
    ),
    procedure.DiameterTest: TestKind(
        ("sphere",), ("D_eff",), plan.plan_diameter, evaluate.diameter_results, _whole
    ),
    procedure.PlateTest: TestKind(
        ("plate",), ("Thickness", "Coplanarity"), plan.plan_plate, evaluate.plate_results, _whole,
        shuffled=False,
    ),
    procedure.BallTest: TestKind(
        ("sphere",), ("P_Size", "P_Form", "L_Dia"), plan.plan_ball, evaluate.ball_results, _whole,
        shuffled=False,
    ),
    procedure.InterimTest: TestKind(
        ("dumbbell",), ("Interim_L", "Interim_D"), plan.plan_interim, evaluate.interim_results,
        _whole, shuffled=False,
    ),
}  # fmt: skip


def kind_of(stage: Stage) -> TestKind:
    """Return the entry of a procedure's kind; InputError for kinds without points."""
    found = KINDS.get(type(stage.procedure.test))
    if found is None:
        raise InputError(
            "acceptance.of_jobs",
            f"'{stage.procedure.id}' is computed from jobs of a calibrated part.",
            "Measure the part as jobs, then use ocmm msa part.",
        )
    return found


def plan_of(stage: Stage) -> tuple[tuple[result.PlannedPosition, ...], tuple[str, ...]]:
    """Return the positions of a test in measuring order, and notes.

    The order is drawn from the seed, so that drift forms no pattern over the volume.
    CalibrationError: an artefact or limit is missing, or an artefact does not suit the volume.
    """
    kind = kind_of(stage)
    for role in kind.roles:
        stage.only(role)
    for quantity in kind.quantities:
        stage.limit(quantity)
    positions, notes = kind.plan(stage, stage.procedure.test)
    if kind.shuffled:
        order = np.random.default_rng([stage.seed, 10]).permutation(len(positions))
        positions = [positions[int(one)] for one in order]
    return tuple(positions), tuple(notes)


def values_of(at: Situation) -> list[result.JudgedValue]:
    """Return all judged values; those replaced by a complete retest are superseded."""
    values = tuple(kind_of(at.stage).values(at))
    newest: dict[tuple[str, str], int] = {}
    for one in values:
        place = one.key, one.quantity
        newest[place] = max(newest.get(place, 0), one.retest)
    return [
        msgspec.structs.replace(one, superseded=one.retest < newest[one.key, one.quantity])
        for one in values
    ]


def quantities_of(values: Sequence[result.JudgedValue]) -> tuple[result.QuantityResult, ...]:
    """Return every quantity with its worst value."""
    found: dict[str, list[int]] = {}
    for index, one in enumerate(values):
        if not one.superseded:
            found.setdefault(one.quantity, []).append(index)
    results = []
    for quantity, indices in found.items():
        worst = max(
            indices,
            key=lambda i: (abs(values[i].error_mm) + values[i].expanded_mm) / values[i].limit_mm,
        )
        one = values[worst]
        results.append(
            result.QuantityResult(
                quantity=quantity,
                count=len(indices),
                worst=worst,
                error_mm=one.error_mm,
                expanded_mm=one.expanded_mm,
                limit_mm=one.limit_mm,
                verdict=worst_of([values[i].verdict for i in indices]),
            )
        )
    return tuple(results)
