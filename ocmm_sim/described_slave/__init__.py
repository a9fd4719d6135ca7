"""Software camera built from a description `ocmm.device/1` only.

In: the description, the sensor view, and its correction lens. Out: an EtherCAT slave whose bytes
follow the description.

See `_described_camera` (EEPROM, object dictionary, camera).
It must not import the host's decoder.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_sim.described_slave._described_camera import DescribedCamera
else:
    __getattr__ = door(__name__)

__all__ = ["DescribedCamera"]
