"""A software camera made of nothing but a description `ocmm.device/1`.

In: the description, what the sensor sees, and the lens that it corrects with. Out: an EtherCAT
slave whose bytes are those of the description.

Read `_described_camera` (EEPROM, object dictionary, camera).
It must not know how the host reads those bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.simulation.described_slave._described_camera import DescribedCamera
else:
    __getattr__ = door(__name__, _described_camera="DescribedCamera")

__all__ = ["DescribedCamera"]
