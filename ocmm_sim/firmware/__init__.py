"""Firmware of a software camera: two memory banks and their FoE server.

In: packets of FoE in the state BOOT. Out: the running bank, also after a power loss at any moment.

Start with `_banks`, then `_foe_server`.
It must not import other parts of the camera.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_sim.firmware._banks import FACTORY, MAKER, FirmwareBanks, PowerLossError, maker_key
    from ocmm_sim.firmware._foe_server import FoeServer
else:
    __getattr__ = door(
        __name__,
        _banks="FACTORY FirmwareBanks MAKER PowerLossError maker_key",
        _foe_server="FoeServer",
    )

__all__ = ["FACTORY", "MAKER", "FirmwareBanks", "FoeServer", "PowerLossError", "maker_key"]
