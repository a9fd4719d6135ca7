"""Software cameras on a wire: processes, links, and fault injection.

In: a rig of software cameras, names of interfaces, faults to inject.
Out: a wire for a master, without hardware; logs of the proxy.

Start with `_virtual_bus` (whole wire without root), `_wire` and
`_camera_process` (cameras on an interface), `_chain` (cable order, execution of faults),
`_named_rig` (for other programs). Faults: `_faults` (kinds), `_proxy` (faulty cable), `_fault_rig`.
It must not import tracking, jobs or screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.bus import _named_rig as named_rig
    from ocmm_sim.bus._camera_process import READY, SegmentConfig
    from ocmm_sim.bus._chain import Chain, FaultCommands, Unit
    from ocmm_sim.bus._fault_rig import CAMERAS, FAR, HOST, NEAR, FaultRig
    from ocmm_sim.bus._faults import (
        COPIED, CORRUPT_WITH_SUM, EXCHANGED, SHARED, CameraDeed, DeedAnswer, FaultKind, Faults,
        FrameKind, LineDirection, LineLog, LineOrder, LineRule, Trick,
    )  # fmt: skip
    from ocmm_sim.bus._named_rig import RigStatus, rig_down, rig_status, rig_up
    from ocmm_sim.bus._proxy import LineTricks, ProxyConfig, kind_of
    from ocmm_sim.bus._virtual_bus import (
        VirtualBus, VirtualWire, errand_virtual, paced, run_both, run_inside,
    )  # fmt: skip
    from ocmm_sim.bus._wire import Wire
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CAMERAS", "COPIED", "CORRUPT_WITH_SUM", "EXCHANGED", "FAR", "HOST", "NEAR", "READY", "SHARED",
    "CameraDeed", "Chain", "DeedAnswer", "FaultCommands", "FaultKind", "FaultRig", "Faults",
    "FrameKind", "LineDirection", "LineLog", "LineOrder", "LineRule", "LineTricks", "ProxyConfig",
    "RigStatus", "SegmentConfig", "Trick", "Unit", "VirtualBus", "VirtualWire", "Wire",
    "errand_virtual", "kind_of", "named_rig", "paced", "rig_down", "rig_status", "rig_up",
    "run_both", "run_inside",
]  # fmt: skip
