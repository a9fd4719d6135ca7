"""Software cameras on a wire: processes and links.

In: a rig of software cameras, names of interfaces.
Out: a wire for a master, without hardware.

Start with `_virtual_bus` (whole wire without root), `_wire` and
`_camera_process` (cameras on an interface), `_chain` (cable order),
`_named_rig` (for other programs). Benchmarks have faulty cameras and a faulty cable.
It must not import tracking, jobs or screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.bus import _named_rig as named_rig
    from ocmm_sim.bus._camera_process import (
        READY, SegmentConfig, input_ended, make_provider, make_units,
    )  # fmt: skip
    from ocmm_sim.bus._chain import Chain, Unit
    from ocmm_sim.bus._named_rig import RigStatus, rig_down, rig_status, rig_up
    from ocmm_sim.bus._virtual_bus import (
        VirtualBus, VirtualWire, errand_virtual, paced, run_both, run_inside,
    )  # fmt: skip
    from ocmm_sim.bus._wire import LinkPort, SteppedCameraTime, Wire
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "READY", "Chain", "LinkPort", "RigStatus", "SegmentConfig", "SteppedCameraTime", "Unit",
    "VirtualBus", "VirtualWire", "Wire", "errand_virtual", "input_ended", "make_provider",
    "make_units", "named_rig", "paced", "rig_down", "rig_status", "rig_up", "run_both",
    "run_inside",
]  # fmt: skip
