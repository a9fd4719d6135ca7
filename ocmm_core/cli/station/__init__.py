"""``ocmm station`` and ``ocmm settings``: the computer that the station runs on, and its settings.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` (the command) and `_page` (what is printed), then `_settings`. It judges nothing
itself: that is `ocmm_core.doctor` and `ocmm_core.settings`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.station._settings import settings_app
    from ocmm_core.cli.station._station import station_app
else:
    __getattr__ = door(__name__, _settings="settings_app", _station="station_app")

__all__ = ["settings_app", "station_app"]
