"""``ocmm station``: the computer that the station runs on.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` (the command) and `_page` (what is printed). It judges nothing itself: that is
`ocmm_core.doctor`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.station._station import station_app
else:
    __getattr__ = door(__name__, _station="station_app")

__all__ = ["station_app"]
