"""Firmware of a software camera: two memory banks and their FoE server.

In: packets of FoE in the state BOOT. Out: the running bank, also after a power loss at any moment.

See `_banks`.
It must not import other parts of the camera.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_sim.firmware._banks import (
        FACTORY,
        MAKER,
        FirmwareBanks,
        FoeServer,
        PowerLossError,
        maker_key,
    )
else:
    __getattr__ = door(
        __name__, _banks="FACTORY FirmwareBanks FoeServer MAKER PowerLossError maker_key"
    )

__all__ = ["FACTORY", "MAKER", "FirmwareBanks", "FoeServer", "PowerLossError", "maker_key"]
