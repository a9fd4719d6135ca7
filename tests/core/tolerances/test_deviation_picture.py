"""Whiskers of touched places: their ends, their classes, and never greener than the verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.tolerances.decisions import (
    CharacteristicResult,
    DeviationClass,
    Verdict,
    deviation_picture,
    not_proven,
    provisional,
)
from ocmm_core.tolerances.zones import Seen
from tests.deviating_job import deviating_job

UP = np.array([0.0, 0.0, 1.0])


def result(
    verdict: Verdict, deviations: list[float], *, name: str = "C", feature: str = "F",
    upper: float = 0.1,
) -> CharacteristicResult:  # fmt: skip
    count = len(deviations)
    places = np.stack([np.arange(count) * 10.0, np.zeros(count), np.zeros(count)], axis=1)
    seen = Seen(
        (feature,) * count, tuple(range(1, count + 1)), places, np.tile(UP, (count, 1)),
        np.array(deviations),
    )  # fmt: skip
    value = 2.0 * max(map(abs, deviations))
    return CharacteristicResult(
        name=name, kind="surface profile", features=(feature,), nominal=0.0, lower=0.0,
        upper=upper, measured=value, deviation=value, uncertainty=0.01, verdict=verdict, seen=seen,
    )  # fmt: skip


def kinds(*results: CharacteristicResult, held: tuple[int, ...] = ()) -> dict[int, DeviationClass]:
    return {item.number: item.kind for item in deviation_picture(results, held).whiskers}


def test_what_is_accepted_is_shown_as_good_and_nothing_else() -> None:
    inside = [0.01, -0.03]
    assert kinds(result(Verdict.CONFORM, inside)) == dict.fromkeys((1, 2), DeviationClass.WITHIN)
    for verdict in (Verdict.NOT_CONFORM, Verdict.NOT_PROVEN):
        shown = kinds(result(verdict, inside))
        assert set(shown.values()) == {DeviationClass.WITHIN_ONLY}


def test_another_result_of_the_feature_takes_the_green_away() -> None:
    good = result(Verdict.CONFORM, [0.01, -0.03])
    for verdict in Verdict:
        other = replace(result(verdict, [0.0], name="D"), seen=None)
        shown = set(kinds(good, other).values())
        green = verdict is Verdict.CONFORM
        assert shown == {DeviationClass.WITHIN if green else DeviationClass.WITHIN_ONLY}


def test_of_two_zones_that_see_a_place_the_worse_one_counts() -> None:
    wide = result(Verdict.CONFORM, [0.06, 0.01], name="wide", upper=0.2)
    narrow = result(Verdict.NOT_CONFORM, [0.06, 0.01], name="narrow", upper=0.1)
    picture = deviation_picture([wide, narrow])
    assert {item.characteristic for item in picture.whiskers} == {"narrow"}
    assert {item.number: item.kind for item in picture.whiskers} == {
        1: DeviationClass.MORE,
        2: DeviationClass.WITHIN_ONLY,
    }


def test_what_is_outside_says_on_which_side() -> None:
    shown = kinds(result(Verdict.NOT_CONFORM, [0.051, -0.051, 0.049]))
    assert shown == {
        1: DeviationClass.MORE, 2: DeviationClass.LESS, 3: DeviationClass.WITHIN_ONLY,
    }  # fmt: skip


def test_a_point_that_is_held_back_says_nothing_else() -> None:
    doubted = not_proven(result(Verdict.CONFORM, [0.01, 0.2]), "A point is held back.")
    shown = kinds(doubted, held=(2,))
    assert shown == {1: DeviationClass.WITHIN_ONLY, 2: DeviationClass.HELD}


def test_what_has_no_result_has_no_whisker() -> None:
    good = result(Verdict.CONFORM, [0.01])
    assert kinds(provisional(good, "Waits.")) == {}
    assert kinds(replace(good, measured=None, verdict=Verdict.NOT_MEASURED)) == {}
    assert kinds(replace(good, upper=0.0)) == {}
    assert deviation_picture(()).worst is None


def test_a_deviation_that_is_no_number_has_no_whisker() -> None:
    lost = result(Verdict.CONFORM, [0.01, 0.02])
    assert lost.seen is not None
    broken = replace(lost, seen=Seen(
        lost.seen.features, lost.seen.numbers, lost.seen.points, lost.seen.outward,
        np.array([np.nan, 0.02]),
    ))  # fmt: skip
    shown = kinds(broken)
    assert shown == {2: DeviationClass.WITHIN}


def test_whiskers_end_where_the_factor_takes_them() -> None:
    picture = deviation_picture([result(Verdict.CONFORM, [0.01, -0.03])])
    assert picture.limit == pytest.approx(0.05)
    # A part of 10 mm: 1 mm for half a tolerance of 0.05 mm.
    assert picture.factor == pytest.approx(20.0)
    for item in picture.whiskers:
        assert item.base_world[2] == pytest.approx(-item.deviation)
        long = item.end_world - item.base_world
        assert long == pytest.approx(20.0 * item.deviation * UP)
    assert picture.worst is not None
    assert picture.worst.number == 2


def test_the_deviations_of_a_job_are_those_that_the_part_has() -> None:
    view, _ = deviating_job()
    picture = deviation_picture(view.characteristics)
    worst = picture.worst
    assert worst is not None
    # The highest place of the wave of the top, and 0.03 mm more.
    assert worst.feature == "T8"
    assert worst.deviation > 0.025
    assert worst.kind is DeviationClass.MORE
    assert picture.count(DeviationClass.WITHIN) == 9 + 36
    bore = [item for item in picture.whiskers if item.feature == "bore"]
    # Three lobes of 4 micrometres; what bulges out of the circle of a bore is missing material.
    assert max(item.deviation for item in bore) == pytest.approx(0.004, abs=1e-4)
    for item in bore:
        towards_axis = item.end_world - item.base_world
        assert item.deviation * float(towards_axis @ towards_axis) != 0.0 or abs(item.share) < 1e-6
