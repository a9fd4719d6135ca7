"""What to do about a fault: wait, lift, or bring the bus up again. A pure state machine.

It is told what became of each cycle and each step, and says what comes next. A fall to SAFEOP is
lifted while the cycle goes on. What puts the identity of a camera in doubt - a broken link, a
restart, a lost or doubled address, a jump of the clock, silence - is answered with a complete new
bring-up, repeated with a growing pause until it succeeds. The bus never ends by itself.
"""

from __future__ import annotations

from enum import Enum, auto

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle._health import CycleFault
from ocmm_core.fieldbus.report import AlarmResponse, BusPhase, alarm_of_error

FIRST_PAUSE_NS = 50_000_000
LONGEST_PAUSE_NS = 500_000_000
PATIENCE_NS = 150_000_000
"""Without one good cycle for so long, only a new bring-up helps."""
LIFT_PATIENCE_NS = 500_000_000
"""So long may the way from SAFEOP back to OP take."""
SETTLED_NS = 300_000_000
"""Good for so long after a bring-up: the next fault begins with the shortest pause."""
_DISTURBED_CYCLES = 3
_ALARM_NS = 500_000_000
"""An alarm is shown for so long after its last sign."""

_DEEP_CYCLES = 2
"""One answer alone may have been damaged on the way."""


def alarm_of(error: BusError) -> str:
    """Return the alarm that stands for an error of the bring-up.

    An error that is no alarm, such as missing rights, keeps its own code; it has its own remedy.
    """
    return alarm_of_error(error.code) or error.code


class Next(Enum):
    """What the owner of the bus does next."""

    CYCLE = auto()
    """Exchange process data."""
    STEP = auto()
    """Take the next step of the bring-up."""
    RESTART = auto()
    """Begin a new bring-up."""
    PAUSE = auto()
    """Do nothing for a moment."""


class Supervisor:
    """Decides after every cycle and step; see the module.

    Parameters
    ----------
    now_ns
        Monotonic host time, as in all calls.

    Attributes
    ----------
    alarm, message, camera
        What disturbs it now; empty in good order.
    """

    def __init__(self, now_ns: int) -> None:
        self.phase = BusPhase.CLOSED
        """Where the bus is."""
        self.alarm = ""
        self.message = ""
        self.camera = ""
        self.recoveries = 0
        """How often operation was reached again."""
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
        """Return what to do now."""
        if self._next is Next.RESTART and now_ns < self._until_ns:
            return Next.PAUSE
        return self._next

    def pause_left_ns(self, now_ns: int) -> int:
        """Return how long the pause lasts."""
        return max(0, self._until_ns - now_ns)

    def stepping(self, phase: BusPhase) -> None:
        """Note that a bring-up goes on."""
        self._next = Next.STEP
        self.phase = BusPhase.RECOVERING if self._was_operational else phase

    def brought_up(self, now_ns: int) -> None:
        """Note that the cameras are in OP; only a good cycle proves it."""
        self._next = Next.CYCLE
        self._good_ns = now_ns
        self._good_since_ns = None
        self._row = self._bad_row = 0
        if not self._was_operational:
            self.phase = BusPhase.START

    def failed(self, error: BusError, now_ns: int) -> None:
        """Note that a bring-up failed."""
        self._show(alarm_of(error), error.what, "", now_ns)
        self._restart(now_ns)

    def good(self, now_ns: int) -> bool:
        """Note a good cycle; say whether it ends a start, a recovery or a fall from OP."""
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
            # What was wrong before operation was reached is over.
            self.alarm = self.message = self.camera = ""
        again = self.phase is BusPhase.RECOVERING or self._fell
        self.recoveries += again and self._was_operational
        first = not self._was_operational
        self._was_operational = True
        self._fell = False
        self.phase = BusPhase.OPERATION
        return first or again

    def bad(self, fault: CycleFault, now_ns: int) -> None:
        """Note a cycle that was lost or refused."""
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
