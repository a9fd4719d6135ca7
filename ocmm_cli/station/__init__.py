"""The computer of a station: ``ocmm station``, ``settings``, ``support``, ``audit`` and ``key``.

In: options. Out: a line with a light for each check, or the same as JSON.

Read `_station` (doctor, support), then `_settings` and `_audit` (integrity, keys). Judgement is in
`ocmm_core.doctor`, `ocmm_core.settings`, `ocmm_core.export.audits` and `ocmm_core.support`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.station._audit import audit_app, key_app
    from ocmm_cli.station._settings import settings_app
    from ocmm_cli.station._station import station_app, support_app
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["audit_app", "key_app", "settings_app", "station_app", "support_app"]
