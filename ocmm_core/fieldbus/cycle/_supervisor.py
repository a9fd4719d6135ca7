"""Reaction to bus faults: wait, lift or restart. A pure state machine.

It receives the outcome of each cycle and step and returns the next action. A fall to SAFEOP is
lifted during cycles. Faults that make a camera's identity uncertain - broken link, restart, lost or
duplicate address, clock jump, silence - trigger complete bring-ups with growing pauses until one
succeeds. The bus never stops without a command.
"""

from __future__ import annotations

from enum import Enum, auto

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle._health import CycleFault
from ocmm_core.fieldbus.report import AlarmResponse, BusPhase, alarm_of_error

FIRST_PAUSE_NS = 50_000_000
LONGEST_PAUSE_NS = 500_000_000
PATIENCE_NS = 150_000_000
"""Without a good cycle for this long, only a bring-up helps."""
LIFT_PATIENCE_NS = 500_000_000
"""Time limit from SAFEOP back to OP."""
SETTLED_NS = 300_000_000
"""After this long in good order the next fault starts with the shortest pause."""
_DISTURBED_CYCLES = 3
_ALARM_NS = 500_000_000
"""Display time of an alarm after its last occurrence."""

_DEEP_CYCLES = 2
"""One answer alone may have been damaged in transit."""


def alarm_of(error: BusError) -> str:
    """Return the alarm of a bring-up error; others, such as missing rights, keep their code."""
    return alarm_of_error(error.code) or error.code


class Next(Enum):
    """Next action of the bus owner."""

    CYCLE = auto()
    STEP = auto()
    RESTART = auto()
    PAUSE = auto()


class Supervisor:
    """Decides after every cycle and step; times are monotonic host time.

    `alarm`, `message` and `camera` describe the current fault; empty in good order.
    """

    def __init__(self, now_ns: int) -> None:
        self.phase = BusPhase.CLOSED
        self.alarm = ""
        self.message = ""
        self.camera = ""
        self.recoveries = 0
        self._next = Next.RESTART
        self._alarm_ns = now_ns
        self._good_ns = now_ns
        self._good_since_ns: int | None = None
        self._pause_ns = FIRST_PAUSE_NS
        self._until_ns = now_ns
        self._row = 0
        self._bad_row = 0
        self._row_alarm = ""
        self._was_operational = False
        self._fell = False

    def next(self, now_ns: int) -> Next:
        if self._next is Next.RESTART and now_ns < self._until_ns:
            return Next.PAUSE
        return self._next

    def pause_left_ns(self, now_ns: int) -> int:
        return max(0, self._until_ns - now_ns)

    def stepping(self, phase: BusPhase) -> None:
        self._next = Next.STEP
        self.phase = BusPhase.RECOVERING if self._was_operational else phase

    def brought_up(self, now_ns: int) -> None:
        """Record that the cameras are in OP; only a good cycle proves it."""
        self._next = Next.CYCLE
        self._good_ns = now_ns
        self._good_since_ns = None
        self._row = self._bad_row = 0
        if not self._was_operational:
            self.phase = BusPhase.START

    def failed(self, error: BusError, now_ns: int) -> None:
        self._show(alarm_of(error), error.what, "", now_ns)
        self._restart(now_ns)

    def good(self, now_ns: int) -> bool:
        """Record a good cycle; return whether it ends a start, recovery or fall."""
        self._row = self._bad_row = 0
        self._row_alarm = ""
        self._good_ns = now_ns
        if self._good_since_ns is None:
            self._good_since_ns = now_ns
        elif now_ns - self._good_since_ns > SETTLED_NS:
            self._pause_ns = FIRST_PAUSE_NS
        if self.alarm and now_ns - self._alarm_ns > _ALARM_NS:
            self.alarm = self.message = self.camera = ""
        reached = self.phase is not BusPhase.OPERATION
        if reached:
            # Faults before operation are over.
            self.alarm = self.message = self.camera = ""
        again = self.phase is BusPhase.RECOVERING or self._fell
        self.recoveries += again and self._was_operational
        first = not self._was_operational
        self._was_operational = True
        self._fell = False
        self.phase = BusPhase.OPERATION
        return first or again

    def bad(self, fault: CycleFault, now_ns: int) -> None:
        """Record a lost or refused cycle."""
        self._show(fault.alarm, fault.reason, fault.camera, now_ns)
        self._bad_row += 1
        spec = fault.alarm.spec
        self._fell |= spec.answer is AlarmResponse.LIFT
        self._row = self._row + 1 if fault.alarm == self._row_alarm else 1
        self._row_alarm = fault.alarm
        self._good_since_ns = None if self._bad_row > _DISTURBED_CYCLES else self._good_since_ns
        if self._bad_row >= _DISTURBED_CYCLES and self.phase is BusPhase.OPERATION:
            self.phase = BusPhase.DISTURBED
        patience = LIFT_PATIENCE_NS if spec.answer is AlarmResponse.LIFT else PATIENCE_NS
        confirmed = _DEEP_CYCLES if fault.deep else spec.confirmed
        surely = confirmed > 0 and self._row >= confirmed
        if surely or now_ns - self._good_ns > patience:
            self._restart(now_ns)

    def _restart(self, now_ns: int) -> None:
        self._next = Next.RESTART
        self._until_ns = now_ns + self._pause_ns
        self._pause_ns = min(2 * self._pause_ns, LONGEST_PAUSE_NS)
        if self._was_operational:
            self.phase = BusPhase.RECOVERING

    def _show(self, alarm: str, message: str, camera: str, now_ns: int) -> None:
        self.alarm, self.message, self.camera = alarm, message, camera
        self._alarm_ns = now_ns
