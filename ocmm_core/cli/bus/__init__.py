"""``ocmm bus`` and ``ocmm rig``: the cameras on the wire, real or software."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.bus._bus import bus_app
    from ocmm_core.cli.bus._options import BusOption
    from ocmm_core.cli.bus._rig import rig_app
    from ocmm_core.cli.bus._session import open_bus
else:
    __getattr__ = door(
        __name__,
        _bus="bus_app",
        _options="BusOption",
        _rig="rig_app",
        _session="open_bus",
    )

__all__ = [
    "BusOption",
    "bus_app",
    "open_bus",
    "rig_app",
]
