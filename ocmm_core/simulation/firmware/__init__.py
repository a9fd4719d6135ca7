"""The firmware of a software camera: two banks of memory, and the server that writes them.

In: packets of FoE in the state BOOT. Out: the bank that runs, also after a loss of power at any
moment.

Read `_banks`, then `_foe_server`.
It must not know anything else of the camera.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.simulation.firmware._banks import (
        FACTORY,
        MAKER,
        FirmwareBanks,
        PowerLossError,
        maker_key,
    )
    from ocmm_core.simulation.firmware._foe_server import FoeServer
else:
    __getattr__ = door(
        __name__,
        _banks="FACTORY FirmwareBanks MAKER PowerLossError maker_key",
        _foe_server="FoeServer",
    )

__all__ = ["FACTORY", "MAKER", "FirmwareBanks", "FoeServer", "PowerLossError", "maker_key"]
