"""Software camera: a slave controller with objects, memory, errors and frames.

In: EtherCAT frames of any master, and images or spots of a frame provider.
Out: answers as of a real camera, including registers, mailboxes and process data.

Start with `_software_camera` (the whole); then `_esc` with `_registers` (controller),
`_segment` (cameras on one wire), `_coe` with `_sdo_values` (objects), `_electronics`, `_store`
(memory, errors, black image), `_sii` and `_esi` (EEPROM, ESI file); `_frames` (providers and
buffer); `_described_slave` (a camera of another maker, from its description).
It must not import optics or the scene: a provider supplies the frames.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.slave import _registers as registers
    from ocmm_sim.slave import _sii as sii
    from ocmm_sim.slave._coe import CoeServer
    from ocmm_sim.slave._described_slave import DescribedCamera
    from ocmm_sim.slave._esc import Esc
    from ocmm_sim.slave._esi import (
        CLOCK_MODES, CONTROLLERS, DC_ACTIVATE, DEVICE_GROUP, ESI_FILE, MAILBOX_REPEATS, MEMORY_END,
        PHYSICAL_PORTS, SII_BYTES, SYNC_PULSE_NS, esi_document, type_name,
    )  # fmt: skip
    from ocmm_sim.slave._frames import (
        CHUNK_FRAMES, FIFO_FRAMES, OVERRUN_FLAG, SENSOR_PX, CameraFrames, FrameBuffer, Frames,
        SimpleSensor, TestPattern,
    )  # fmt: skip
    from ocmm_sim.slave._registers import (
        AL_STATUS, AL_SYNC, INIT, OP, PREOP, SAFEOP, STATION_ADDRESS, STATION_ALIAS, SYSTEM_TIME,
        TIME_DIFFERENCE, SlaveClock, difference_register, time_difference,
    )  # fmt: skip
    from ocmm_sim.slave._sdo_values import Abort, AbortError
    from ocmm_sim.slave._segment import ETHERTYPE, DatagramCommand, Segment
    from ocmm_sim.slave._sii import checksum_of_configuration, sii_image
    from ocmm_sim.slave._software_camera import SoftwareCamera
    from ocmm_sim.slave._store import CameraStore
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AL_STATUS", "AL_SYNC", "CHUNK_FRAMES", "CLOCK_MODES", "CONTROLLERS", "DC_ACTIVATE",
    "DEVICE_GROUP", "ESI_FILE", "ETHERTYPE", "FIFO_FRAMES", "INIT", "MAILBOX_REPEATS", "MEMORY_END",
    "OP", "OVERRUN_FLAG", "PHYSICAL_PORTS", "PREOP", "SAFEOP", "SENSOR_PX", "SII_BYTES",
    "STATION_ADDRESS", "STATION_ALIAS", "SYNC_PULSE_NS", "SYSTEM_TIME", "TIME_DIFFERENCE", "Abort",
    "AbortError", "CameraFrames", "CameraStore", "CoeServer", "DatagramCommand", "DescribedCamera",
    "Esc", "FrameBuffer", "Frames", "Segment", "SimpleSensor", "SlaveClock", "SoftwareCamera",
    "TestPattern", "checksum_of_configuration", "difference_register", "esi_document", "registers",
    "sii", "sii_image", "time_difference", "type_name",
]  # fmt: skip
