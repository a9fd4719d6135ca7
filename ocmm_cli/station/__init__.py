"""``ocmm station``, ``ocmm settings``, ``ocmm support``: computer of a station, and support.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` (doctor, support), then `_settings`. Judgement is in `ocmm_core.doctor`,
`ocmm_core.settings` and `ocmm_core.support`.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_cli.station._settings import settings_app
    from ocmm_cli.station._station import station_app, support_app
else:
    __getattr__ = door(__name__)

__all__ = ["settings_app", "station_app", "support_app"]
