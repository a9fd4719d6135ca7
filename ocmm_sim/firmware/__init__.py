"""Firmware of a software camera: two memory banks and their FoE server.

In: packets of FoE in the state BOOT. Out: the running bank, also after a power loss at any moment.

See `_banks`.
It must not import other parts of the camera.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_sim.firmware._banks import (
        FACTORY, MAKER, FirmwareBanks, FoeServer, PowerLossError, maker_key,
    )  # fmt: skip
else:
    __getattr__ = door(__name__)

__all__ = ["FACTORY", "MAKER", "FirmwareBanks", "FoeServer", "PowerLossError", "maker_key"]
