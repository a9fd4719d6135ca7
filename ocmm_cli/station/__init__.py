"""The computer of a station: ``ocmm station``, ``settings``, ``support``, ``audit`` and ``key``.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` with `_doctor`, `_support`, then `_settings` and `_audit` (integrity, keys).
Judgement is in `doctor`, `settings`, `export.audits` and `support` of the core.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.station._audit import audit_app, key_app
    from ocmm_cli.station._settings import settings_app
    from ocmm_cli.station._station import station_app
    from ocmm_cli.station._support import support_app
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["audit_app", "key_app", "settings_app", "station_app", "support_app"]
