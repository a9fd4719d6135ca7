"""Places measured twice: what chance allows, and since when something moved."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from ocmm_core.calibration.guided import (
    JudgedRepeat,
    Repeat,
    RestingPosition,
    judge_repeats,
    repeat_finding,
)
from ocmm_core.calibration.guided._repeats import moved_between
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

REMEDY = "Find what moved, fix it, and verify again."


def at(minute: float) -> str:
    return (datetime(2026, 3, 2, 8, 0, tzinfo=UTC) + timedelta(minutes=minute)).isoformat()


def repeat(place: str, shift: Float, first: float = 0.0, again: float = 30.0) -> Repeat:
    covariance = np.diag([1.0, 4.0, 9.0]) * 1e-6
    here = np.array([10.0, -20.0, 30.0])
    return Repeat(
        place,
        RestingPosition(here, covariance, at(first)),
        RestingPosition(here + shift, covariance, at(again)),
    )


def judged(place: str, first: float, again: float, *, consistent: bool) -> JudgedRepeat:
    return JudgedRepeat(
        place, at(first), at(again), np.array([0.05, 0.0, 0.0]), 3.0 if consistent else 99.0, 16.0
    )


def test_the_square_is_that_of_both_positions_and_the_seat() -> None:
    (one,) = judge_repeats([repeat("nest 1", np.array([0.0, 0.006, 0.0]))], seat_sigma_mm=0.002)
    # 6 um against twice (2 um)^2 of the position and twice (2 um)^2 of the seat.
    assert one.normalised_square == pytest.approx(36.0 / 16.0)
    assert one.shift_mm == pytest.approx(0.006)
    assert one.consistent


@pytest.mark.statistics
def test_chance_is_shared_by_all_repeats() -> None:
    rng = np.random.default_rng(11)
    chance, sets, wrong = 0.05, 4000, 0
    spread = np.sqrt(2.0 * (np.array([1.0, 4.0, 9.0]) + 4.0)) * 1e-3
    for _ in range(sets):
        pairs = [repeat(str(i), spread * rng.standard_normal(3)) for i in range(3)]
        wrong += any(not one.consistent for one in judge_repeats(pairs, chance))
    # Bonferroni is all but exact for independent repeats; three standard deviations of the count.
    assert wrong / sets == pytest.approx(chance, abs=3.0 * np.sqrt(chance / sets))


def test_a_shift_is_named_with_its_place_and_time() -> None:
    far = np.array([0.0, 0.0, 0.055])
    found = judge_repeats(
        [repeat("line 1, nest 1", far, 0.0, 30.0), repeat("line 4, nest 1", 0.0 * far, 14.0, 31.0)]
    )
    assert [one.consistent for one in found] == [False, True]
    finding = repeat_finding(found, REMEDY)
    assert finding is not None
    assert finding.refuses
    assert not finding.forcible
    assert "1 of 2 places" in finding.what
    assert "line 1, nest 1 by 55 um" in finding.what
    # It was before the second place was measured first.
    assert "between 2026-03-02 08:00:00 and 2026-03-02 08:14:00 UTC" in finding.what
    assert finding.remedy == REMEDY


def test_nothing_moved_says_nothing() -> None:
    found = judge_repeats([repeat("nest 1", np.array([0.002, 0.0, 0.0]))])
    assert repeat_finding(found, REMEDY) is None
    assert moved_between(found) is None
    assert judge_repeats([]) == ()


@pytest.mark.parametrize(
    ("repeats", "wanted"),
    [
        # All moved: after the last one was measured first, before the first one came again.
        ([(0, 30, False), (10, 31, False)], (10, 30)),
        # The same place three times: between the last consistent and the first inconsistent.
        ([(0, 10, True), (0, 20, False), (0, 30, False)], (10, 20)),
        # One takes its time off the end, another one off the beginning.
        ([(0, 30, False), (25, 31, True), (0, 5, True)], (5, 25)),
        # Points rejected by the later test free capacity for the earlier one.
        ([(0, 30, False), (4, 9, True), (0, 5, True)], (9, 30)),
        # No single change explains these: the time of all inconsistent ones.
        ([(0, 30, False), (0, 30, True)], (0, 30)),
        ([(0, 10, False), (20, 30, False)], (0, 30)),
    ],
)
def test_the_time_is_what_all_repeats_leave(
    repeats: list[tuple[int, int, bool]], wanted: tuple[int, int]
) -> None:
    found = [judged("p", first, again, consistent=good) for first, again, good in repeats]
    assert moved_between(found) == (at(wanted[0]), at(wanted[1]))


def test_what_is_no_number_is_refused() -> None:
    nowhere = repeat("nest 1", np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(CalibrationError, match="not a number"):
        judge_repeats([nowhere])
    good = repeat("nest 1", np.zeros(3))
    negative = RestingPosition(good.first.world, -np.eye(3), good.first.utc)
    with pytest.raises(CalibrationError, match="invalid covariance"):
        judge_repeats([Repeat("nest 1", negative, good.again)])
