"""Software GigE Vision cameras, and the virtual rig seen by them.

In: images with the time of their exposure. Out: what a real camera sends: GVCP on port 3956 of
its own address, a GenICam description from its memory, GVSP; faults on request.

Read `_registers` (memory and description), `_device` (control, stream, faults), then `_virtual`
(the virtual rig in a private network namespace). It must not import the receiver of the frames,
except for its start.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.genicam._device import CameraFaults, GigeCamera
    from ocmm_sim.genicam._registers import Feature, GigeConfig, Memory
    from ocmm_sim.genicam._virtual import GENICAM_RATE_HZ, packed, virtual_genicam_feed
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "GENICAM_RATE_HZ", "CameraFaults", "Feature", "GigeCamera", "GigeConfig", "Memory", "packed",
    "virtual_genicam_feed",
]  # fmt: skip
