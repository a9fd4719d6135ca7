"""Responses of the supervisor to faults: wait, lift, or bring the bus up again."""

from __future__ import annotations

import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import CycleFault, Next, Supervisor, Trouble
from ocmm_core.fieldbus.cycle._supervisor import (
    FIRST_PAUSE_NS,
    LIFT_PATIENCE_NS,
    LONGEST_PAUSE_NS,
    PATIENCE_NS,
)
from ocmm_core.fieldbus.report import Alarm, BusPhase

MS = 1_000_000


def fault(alarm: Alarm, *, deep: bool = False, camera: str = "") -> CycleFault:
    return CycleFault(Trouble.BAD, alarm, f"words of {alarm}", camera, deep)


def phase_of(supervisor: Supervisor) -> BusPhase:
    """Return the phase; mypy does not know that calls change it."""
    return supervisor.phase


def running(now_ns: int = 0) -> Supervisor:
    supervisor = Supervisor(now_ns)
    assert supervisor.next(now_ns) is Next.RESTART
    supervisor.stepping(BusPhase.SCAN)
    assert (supervisor.phase, supervisor.next(now_ns)) == (BusPhase.SCAN, Next.STEP)
    supervisor.brought_up(now_ns)
    assert (supervisor.phase, supervisor.next(now_ns)) == (BusPhase.START, Next.CYCLE)
    assert supervisor.good(now_ns)
    assert supervisor.phase is BusPhase.OPERATION
    assert supervisor.recoveries == 0
    return supervisor


def cycles_until_restart(supervisor: Supervisor, what: CycleFault, limit: int = 2000) -> int:
    """Repeat the same fault every millisecond; return the number until a new bring-up."""
    for cycle in range(1, limit + 1):
        supervisor.bad(what, cycle * MS)
        if supervisor.next(cycle * MS) is not Next.CYCLE:
            return cycle
    raise AssertionError("never")


def test_a_single_lost_cycle_is_an_alarm_but_no_disturbance() -> None:
    supervisor = running()
    supervisor.bad(fault(Alarm.LOST_ANSWERS), 1 * MS)
    assert supervisor.alarm == Alarm.LOST_ANSWERS
    assert supervisor.phase is BusPhase.OPERATION
    assert not supervisor.good(2 * MS)
    assert supervisor.alarm == Alarm.LOST_ANSWERS
    assert not supervisor.good(600 * MS)
    assert (supervisor.alarm, supervisor.message) == ("", "")


def test_three_in_a_row_are_a_disturbance_that_ends_with_the_first_good_one() -> None:
    supervisor = running()
    for cycle in range(3):
        supervisor.bad(fault(Alarm.PAYLOAD, camera="left"), cycle * MS)
    assert supervisor.phase is BusPhase.DISTURBED
    assert supervisor.camera == "left"
    assert not supervisor.good(4 * MS)
    assert supervisor.recoveries == 0
    assert phase_of(supervisor) is BusPhase.OPERATION
    assert supervisor.alarm == ""


def test_a_fall_to_safeop_that_was_lifted_is_a_recovery() -> None:
    supervisor = running()
    supervisor.bad(fault(Alarm.WATCHDOG), 1 * MS)
    assert supervisor.good(10 * MS)
    assert supervisor.recoveries == 1
    assert not supervisor.good(11 * MS)


@pytest.mark.parametrize(
    ("what", "cycles"),
    [
        (fault(Alarm.LINK_DOWN), 1),
        (fault(Alarm.LEFT_OPERATION, deep=True), 2),
        (fault(Alarm.RESTARTED, deep=True), 2),
        (fault(Alarm.DUPLICATE_ADDRESS), 2),
        (fault(Alarm.CLOCK_JUMP), 3),
        (fault(Alarm.CAMERA_MISSING), 10),
        (fault(Alarm.SILENT), PATIENCE_NS // MS + 1),
        (fault(Alarm.FROZEN), PATIENCE_NS // MS + 1),
        (fault(Alarm.WORKING_COUNTER), PATIENCE_NS // MS + 1),
        (fault(Alarm.WATCHDOG), LIFT_PATIENCE_NS // MS + 1),
        (fault(Alarm.LEFT_OPERATION), LIFT_PATIENCE_NS // MS + 1),
    ],
)
def test_each_fault_is_waited_for_as_long_as_that_can_help(what: CycleFault, cycles: int) -> None:
    supervisor = running()
    assert cycles_until_restart(supervisor, what) == cycles
    assert supervisor.phase is BusPhase.RECOVERING
    assert supervisor.next(cycles * MS) is Next.PAUSE
    assert supervisor.next(cycles * MS + FIRST_PAUSE_NS) is Next.RESTART


def test_losing_every_second_cycle_never_leads_to_a_bring_up() -> None:
    supervisor = running()
    for cycle in range(0, 5000, 2):
        supervisor.bad(fault(Alarm.LOST_ANSWERS), cycle * MS)
        supervisor.good((cycle + 1) * MS)
        assert supervisor.next(cycle * MS) is Next.CYCLE
    assert supervisor.phase is BusPhase.OPERATION


def test_bring_ups_that_fail_are_repeated_with_a_growing_pause_that_has_an_end() -> None:
    supervisor = running()
    now = cycles_until_restart(supervisor, fault(Alarm.LINK_DOWN)) * MS
    pauses = []
    for _ in range(8):
        pauses.append(supervisor.pause_left_ns(now))
        now += pauses[-1]
        assert supervisor.next(now) is Next.RESTART
        supervisor.stepping(BusPhase.SCAN)
        assert supervisor.phase is BusPhase.RECOVERING
        supervisor.failed(BusError("bus.alias", "Exchanged.", "Put them back."), now)
        assert (supervisor.alarm, supervisor.message) == (Alarm.ALIAS, "Exchanged.")
    assert pauses == sorted(pauses)
    assert (pauses[0], pauses[-1]) == (FIRST_PAUSE_NS, LONGEST_PAUSE_NS)
    now += pauses[-1]
    supervisor.stepping(BusPhase.LINK)
    supervisor.brought_up(now)
    assert supervisor.phase is BusPhase.RECOVERING
    assert supervisor.good(now)
    assert (supervisor.recoveries, supervisor.alarm) == (1, "")
    # The next fault is answered quickly again only after some time in good order.
    supervisor.good(now + 400 * MS)
    supervisor.bad(fault(Alarm.LINK_DOWN), now + 401 * MS)
    assert supervisor.pause_left_ns(now + 401 * MS) == FIRST_PAUSE_NS


def test_a_bring_up_that_never_brings_a_good_cycle_is_repeated() -> None:
    supervisor = running()
    begin = cycles_until_restart(supervisor, fault(Alarm.LINK_DOWN)) * MS
    supervisor.stepping(BusPhase.SCAN)
    supervisor.brought_up(begin)
    for cycle in range(1, 400):
        supervisor.bad(fault(Alarm.FROZEN), begin + cycle * MS)
        if supervisor.next(begin + cycle * MS) is not Next.CYCLE:
            break
    assert cycle == PATIENCE_NS // MS + 1
    assert supervisor.recoveries == 0


def test_errors_of_a_bring_up_have_an_alarm() -> None:
    for code, alarm in (
        ("bus.no_cameras", Alarm.SILENT),
        ("bus.no_interface", Alarm.LINK_DOWN),
        ("bus.down", Alarm.LINK_DOWN),
        ("bus.duplicate", Alarm.DUPLICATE),
        ("bus.cameras", Alarm.CAMERAS),
    ):
        supervisor = running()
        supervisor.failed(BusError(code, "words", "remedy"), 0)
        assert supervisor.alarm == alarm
