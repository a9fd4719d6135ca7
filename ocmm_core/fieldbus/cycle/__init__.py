"""The bus in operation: brought up, run cycle by cycle, judged, and supervised.

In: answers of one cycle, and the clock. Out: what each camera brought and whether it is fresh,
accounts in which every cycle stands once, and what to do about a fault.

Read `_bus` (brings cameras up and runs cycles) with `_bringup`, `_health` and `_frame_content`
(is it fresh and whole) and `_clock` (all pure arithmetic), `_accounts` (the books), `_supervisor`
(wait, lift, or bring up again: a pure state machine), `_watch` and `_port_errors` (what the
cameras say, and at which port frames break), `_journal` (what happened, in few words).
It must not know the ring or the process it runs in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.fieldbus.cycle._accounts import BusAccounts
    from ocmm_core.fieldbus.cycle._bringup import BusSettings
    from ocmm_core.fieldbus.cycle._bus import CameraBus
    from ocmm_core.fieldbus.cycle._clock import CyclePacer
    from ocmm_core.fieldbus.cycle._health import (
        CameraPast,
        CycleAnswer,
        CycleFault,
        Schedule,
        Trouble,
        advance,
        first_frame,
        judge,
    )
    from ocmm_core.fieldbus.cycle._journal import ERROR_OVER, OPERATION
    from ocmm_core.fieldbus.cycle._supervisor import Next, Supervisor
    from ocmm_core.fieldbus.cycle._watch import CameraView, WatchView
else:
    __getattr__ = door(
        __name__,
        _accounts="BusAccounts",
        _bringup="BusSettings",
        _bus="CameraBus",
        _clock="CyclePacer",
        _watch="CameraView WatchView",
        _health="CycleAnswer CameraPast CycleFault Schedule Trouble advance first_frame judge",
        _journal="ERROR_OVER OPERATION",
        _supervisor="Next Supervisor",
    )

__all__ = [
    "ERROR_OVER",
    "OPERATION",
    "BusAccounts",
    "BusSettings",
    "CameraBus",
    "CameraPast",
    "CameraView",
    "CycleAnswer",
    "CycleFault",
    "CyclePacer",
    "Next",
    "Schedule",
    "Supervisor",
    "Trouble",
    "WatchView",
    "advance",
    "first_frame",
    "judge",
]
