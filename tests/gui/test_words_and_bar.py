"""Numbers as they are written, and the scale of the tolerance bar."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict, rule_id
from ocmm_gui.charts._tolerance_bar import make_scale
from ocmm_gui.kit import DASHES, millimetres


@pytest.mark.parametrize(
    ("value", "signed", "text"),
    [
        (1.23449, False, "1.234"),
        (1.2346, True, "+1.235"),
        (-0.0001, True, "+0.000"),
        (-12.5, True, "-12.500"),
        (None, True, DASHES),
        (float("nan"), False, DASHES),
    ],
)
def test_lengths_are_written_with_three_decimals(
    value: float | None, signed: bool, text: str
) -> None:
    assert millimetres(value, signed=signed) == text


def _result(
    deviation: float | None, uncertainty: float | None, lower: float = -0.05, kind: str = "diameter"
) -> CharacteristicResult:
    measured = None if deviation is None else 20.0 + deviation
    return CharacteristicResult(
        name="D",
        kind=kind,
        features=("A",),
        nominal=20.0,
        lower=lower,
        upper=0.05,
        measured=measured,
        deviation=deviation,
        uncertainty=uncertainty,
        verdict=Verdict.CONFORM,
    )


def test_the_limits_stand_symmetrically_and_the_ends_hold_what_is_beyond() -> None:
    scale = make_scale(_result(0.0, 0.01))
    assert scale.place(0.0) == pytest.approx(0.5)
    assert scale.place(-0.05) == pytest.approx(1.0 - scale.place(0.05))
    assert scale.place(9.0) == 1.0
    assert scale.place(-9.0) == 0.0


def test_the_guard_band_is_u_and_only_where_the_plan_has_one() -> None:
    assert make_scale(_result(0.0, 0.012)).guard == pytest.approx(0.012)
    assert make_scale(replace(_result(0.0, 0.012), rule=rule_id("simple"))).guard == 0.0
    assert make_scale(_result(None, None)).guard == 0.0


def test_a_guard_band_wider_than_the_tolerance_leaves_no_green() -> None:
    scale = make_scale(_result(0.0, 0.2))
    low, high = scale.proven
    assert low >= high


def test_a_tolerance_of_zero_width_has_a_scale() -> None:
    scale = make_scale(_result(0.05, 0.01, lower=0.05))
    assert 0.0 < scale.place(0.05) < 1.0


def test_a_form_deviation_has_no_lower_limit() -> None:
    scale = make_scale(_result(0.01, 0.02, lower=0.0, kind="form"))
    assert scale.place(0.0) == 0.0
    assert scale.proven == pytest.approx((0.0, 0.03))
