"""Points suspect because of the tip, from its history alone."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from ocmm_core.calibration.records import TipEvent, TipEventKind
from ocmm_core.inspection.finished import last_good_utc
from ocmm_core.inspection.finished._later_findings import tip_points_in_doubt

BEGUN = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
TIP = "6 mm"
TAKEN = {number: BEGUN + timedelta(minutes=10 * number) for number in range(1, 7)}
"""Points at 08:10 to 09:00."""


def event(minute: float, kind: TipEventKind, *, since: float | None = None) -> TipEvent:
    return TipEvent(
        utc=(BEGUN + timedelta(minutes=minute)).isoformat(),
        kind=kind,
        tip=TIP,
        since_utc="" if since is None else (BEGUN + timedelta(minutes=since)).isoformat(),
        who="inspector",
        reason="A reason.",
    )


QUALIFIED = event(0, TipEventKind.QUALIFIED)


def held(*events: TipEvent) -> tuple[list[int], list[int]]:
    doubts = tip_points_in_doubt([QUALIFIED, *events], TIP, TAKEN)
    return sorted(doubts.open), sorted(doubts.failed)


def test_a_blow_leaves_the_points_before_it_as_they_are() -> None:
    shock = event(45.1, TipEventKind.DOUBTED, since=45)
    assert held(shock) == ([5, 6], [])
    assert held(shock, event(70, TipEventKind.PASSED)) == ([], [])


def test_a_tip_that_was_mounted_puts_all_since_the_last_check_in_doubt() -> None:
    checked, mounted = event(25, TipEventKind.PASSED), event(45, TipEventKind.MOUNTED)
    assert held(checked, mounted) == ([3, 4, 5, 6], [])
    assert held(checked, mounted, event(70, TipEventKind.PASSED)) == ([], [])


def test_a_failed_check_costs_the_points_since_the_last_good_one_for_good() -> None:
    checked, failed = event(25, TipEventKind.PASSED), event(45, TipEventKind.FAILED)
    assert held(checked, failed) == ([], [3, 4, 5, 6])
    # A later pass proves nothing about the points before the failure.
    assert held(checked, failed, event(55, TipEventKind.PASSED)) == ([], [3, 4, 5])
    again = event(56, TipEventKind.NOT_QUALIFIED)
    assert held(checked, failed, event(55, TipEventKind.PASSED), again) == ([], [3, 4, 5, 6])


def test_a_doubt_and_then_a_failure() -> None:
    shock, failed = event(35, TipEventKind.DOUBTED, since=35), event(36, TipEventKind.FAILED)
    assert held(shock, failed) == ([4, 5, 6], [1, 2, 3, 4, 5, 6])
    assert held(shock, failed, event(70, TipEventKind.PASSED)) == ([], [1, 2, 3, 4, 5, 6])


def test_other_tips_are_no_matter() -> None:
    other = [
        TipEvent(utc=one.utc, kind=one.kind, tip="2 mm", who="", reason="")
        for one in (event(5, TipEventKind.FAILED), event(50, TipEventKind.PASSED))
    ]
    assert held(*other) == ([], [])
    assert last_good_utc([QUALIFIED, *other], TIP) == BEGUN
    assert last_good_utc(other, TIP) is None


def test_of_several_failures_and_doubts_the_last_one_is_the_reason() -> None:
    failed, again = event(35, TipEventKind.FAILED), event(70, TipEventKind.NOT_QUALIFIED)
    doubts = tip_points_in_doubt([QUALIFIED, failed, again], TIP, TAKEN)
    assert set(doubts.failed.values()) == {
        f"The qualification of tip '{TIP}' failed (2026-03-01T09:10 UTC)."
    }
    shock = event(45, TipEventKind.DOUBTED, since=45)
    mounted = event(55, TipEventKind.MOUNTED, since=55)
    doubts = tip_points_in_doubt([QUALIFIED, shock, mounted], TIP, TAKEN)
    assert doubts.open == {5: "A reason.", 6: f"Tip '{TIP}' was mounted again."}
