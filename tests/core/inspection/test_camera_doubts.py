"""Points suspect because of the cameras, from the history of the calibration alone."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from ocmm_core.calibration.records import Event, EventKind
from ocmm_core.inspection.finished._later_findings import points_in_doubt

BEGUN = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
TAKEN = {number: BEGUN + timedelta(minutes=10 * number) for number in range(1, 7)}
"""Points at 08:10 to 09:00."""
OWN, OTHER = "a" * 64, "b" * 64


def event(
    minute: float,
    kind: EventKind,
    *,
    since: float | None = None,
    calibration: str = OWN,
    evidence: str = "",
) -> Event:
    return Event(
        utc=(BEGUN + timedelta(minutes=minute)).isoformat(),
        kind=kind,
        calibration=calibration,
        evidence=evidence,
        since_utc="" if since is None else (BEGUN + timedelta(minutes=since)).isoformat(),
        who="technician",
        reason="A reason.",
    )


BEGINNING = (event(-2, EventKind.ACCEPTED), event(-1, EventKind.PASSED, evidence="first"))
FAILED, PASSED = EventKind.FAILED, EventKind.PASSED


def held(*events: Event) -> tuple[list[int], list[int]]:
    doubts = points_in_doubt([*BEGINNING, *events], OWN, TAKEN)
    return sorted(doubts.open), sorted(doubts.failed)


def test_nothing_happened() -> None:
    assert held() == ([], [])
    assert held(event(70, PASSED)) == ([], [])
    assert held(event(70, EventKind.ACCEPTED, calibration=OTHER)) == ([], [])


def test_a_doubt_of_the_monitor_lasts_until_a_verification_passes() -> None:
    doubt = event(55, EventKind.SUSPECTED, since=35)
    assert held(doubt) == ([4, 5, 6], [])
    assert held(doubt, event(70, PASSED)) == ([], [])
    # If no check found all well, the last good check is the last certain event.
    checked = event(15, PASSED)
    assert held(checked, event(55, EventKind.SUSPECTED)) == ([2, 3, 4, 5, 6], [])


def test_a_failed_verification_costs_the_points_since_the_last_good_one() -> None:
    checked, failed = event(25, PASSED), event(45, FAILED)
    assert held(checked, failed) == ([], [3, 4, 5, 6])
    # A later pass proves nothing about the points before the failure.
    assert held(checked, failed, event(55, PASSED)) == ([], [3, 4, 5])
    assert held(checked, failed, event(55, PASSED), event(70, FAILED)) == ([], [3, 4, 5, 6])


def test_never_verified_and_then_failed() -> None:
    doubts = points_in_doubt([BEGINNING[0], event(70, FAILED)], OWN, TAKEN)
    assert sorted(doubts.failed) == [1, 2, 3, 4, 5, 6]


def test_a_doubt_that_a_new_calibration_followed_is_believed() -> None:
    doubt = event(45, EventKind.SUSPECTED, since=35)
    replaced = event(70, EventKind.ACCEPTED, calibration=OTHER)
    # It was not verified again: changes that the monitor had not yet noticed are suspect as well.
    assert held(event(25, PASSED), doubt, replaced) == ([4, 5, 6], [3, 4, 5, 6])
    # Events of the other calibration do not concern it.
    assert held(event(70, FAILED, calibration=OTHER)) == ([], [])


def test_an_artefact_that_was_wrong_takes_the_verification_away() -> None:
    checked = event(25, PASSED, evidence="second")
    fallen = event(70, EventKind.FALLEN, since=0, evidence="second")
    assert held(checked, fallen) == ([1, 2, 3, 4, 5, 6], [])
    assert held(checked, fallen, event(80, PASSED, evidence="third")) == ([], [])
    # A good check after it had been made already.
    assert held(checked, event(65, PASSED, evidence="third"), fallen) == ([], [])
    # A failure that the fallen one had seemed to answer.
    failed = event(15, FAILED)
    assert held(failed, checked, fallen) == ([1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 6])


def test_an_artefact_that_was_wrong_takes_the_calibration_away_for_good() -> None:
    fallen = event(70, EventKind.FALLEN, since=-60)
    assert held(fallen) == ([], [1, 2, 3, 4, 5, 6])
    assert held(fallen, event(80, PASSED)) == ([], [1, 2, 3, 4, 5, 6])


def test_of_several_failures_the_first_one_is_the_reason() -> None:
    doubts = points_in_doubt([*BEGINNING, event(35, FAILED), event(70, FAILED)], OWN, TAKEN)
    assert set(doubts.failed.values()) == {"The verification of 2026-03-01 08:35 UTC failed."}


def test_recall_starts_at_last_observation_of_late_accepted_verification() -> None:
    assert held(event(45, PASSED, since=25), event(70, FAILED)) == ([], [3, 4, 5, 6])
