"""``ocmm station``, ``ocmm settings``, ``ocmm support``: the computer of a station, and help.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` (the command) and `_page` (what is printed), then `_settings` and `_support`. It
judges nothing itself: that is `ocmm_core.doctor`, `ocmm_core.settings` and `ocmm_core.support`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.station._settings import settings_app
    from ocmm_core.cli.station._station import station_app
    from ocmm_core.cli.station._support import support_app
else:
    __getattr__ = door(
        __name__, _settings="settings_app", _station="station_app", _support="support_app"
    )

__all__ = ["settings_app", "station_app", "support_app"]
