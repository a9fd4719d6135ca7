"""Bus operation: bring-up, cycles, validation and supervision.

In: answers of one cycle, and the clock.
Out: new frames of each camera with a freshness verdict, counters in which every cycle is counted
once, and the reaction to faults.

Start with `_bus` (bring-up, cycles, bus clock); then `_bringup`, `_health` (freshness and
integrity), `_accounts` (counters, events), `_supervisor` (wait, lift or restart: a pure state
machine), `_watch` (camera states, port errors).

It must not import the ring or its process.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.cycle._accounts import ERROR_OVER, OPERATION, BusAccounts
    from ocmm_core.fieldbus.cycle._bringup import BusSettings
    from ocmm_core.fieldbus.cycle._bus import CameraBus, CyclePacer
    from ocmm_core.fieldbus.cycle._health import (
        CameraPast, CycleAnswer, CycleFault, Schedule, Trouble, advance, first_frame, judge,
    )  # fmt: skip
    from ocmm_core.fieldbus.cycle._supervisor import Next, Supervisor
    from ocmm_core.fieldbus.cycle._watch import CameraView, WatchView
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ERROR_OVER", "OPERATION", "BusAccounts", "BusSettings", "CameraBus", "CameraPast",
    "CameraView", "CycleAnswer", "CycleFault", "CyclePacer", "Next", "Schedule", "Supervisor",
    "Trouble", "WatchView", "advance", "first_frame", "judge",
]  # fmt: skip
