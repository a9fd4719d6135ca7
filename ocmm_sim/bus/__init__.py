"""Software cameras on a wire: processes, links, and fault injection.

In: a rig of software cameras, names of interfaces, faults to inject.
Out: a wire for a master, without hardware.

Start with `_virtual_bus` (whole wire without root), `_wire` and
`_camera_process` (cameras on an interface), `_chain` (cable order, execution of faults),
`_named_rig` (for other programs). `_faults`: kinds of faults; benchmarks have a faulty cable.
It must not import tracking, jobs or screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.bus import _named_rig as named_rig
    from ocmm_sim.bus._camera_process import READY, SegmentConfig, input_ended
    from ocmm_sim.bus._chain import Chain, FaultCommands, Unit
    from ocmm_sim.bus._faults import (
        COPIED, CORRUPT_WITH_SUM, EXCHANGED, SHARED, CameraDeed, DeedAnswer, FaultKind, Faults,
    )  # fmt: skip
    from ocmm_sim.bus._named_rig import RigStatus, rig_down, rig_status, rig_up
    from ocmm_sim.bus._virtual_bus import (
        VirtualBus, VirtualWire, errand_virtual, paced, run_both, run_inside,
    )  # fmt: skip
    from ocmm_sim.bus._wire import LinkPort, Wire
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "COPIED", "CORRUPT_WITH_SUM", "EXCHANGED", "READY", "SHARED", "CameraDeed", "Chain",
    "DeedAnswer", "FaultCommands", "FaultKind", "Faults", "LinkPort", "RigStatus", "SegmentConfig",
    "Unit", "VirtualBus", "VirtualWire", "Wire", "errand_virtual", "input_ended", "named_rig",
    "paced", "rig_down", "rig_status", "rig_up", "run_both", "run_inside",
]  # fmt: skip
