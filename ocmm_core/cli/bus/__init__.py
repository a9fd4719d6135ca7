"""``ocmm bus`` and ``ocmm rig``: the cameras on the wire, real or software.

In: a network interface or a source, a camera, an object. Out: tables, pictures and files.

Read `_bus` (who is there, what they hold) with `_session` (the bus brought up, asked, given back)
and `_options`. `_watch` shows the report of a running bus, `_camera` makes snapshots and black
images, `_bus` makes a recording for Wireshark, and `_decode` accounts for one of tcpdump.
`_maintenance` has the commands for one camera. `_rig` makes software cameras on
named interfaces.
It holds no protocol: that is `fieldbus`, run by `acquisition.bus_process`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.bus._bus import bus_app
    from ocmm_core.cli.bus._maintenance import camera_app
    from ocmm_core.cli.bus._options import BusOption
    from ocmm_core.cli.bus._rig import rig_app
    from ocmm_core.cli.bus._session import open_bus
else:
    __getattr__ = door(
        __name__,
        _bus="bus_app",
        _maintenance="camera_app",
        _options="BusOption",
        _rig="rig_app",
        _session="open_bus",
    )

__all__ = ["BusOption", "bus_app", "camera_app", "open_bus", "rig_app"]
