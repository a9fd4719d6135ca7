"""Settings of a station and of its users.

In: settings documents (`ocmm.settings/1`, TOML) of the station and of the user.
Out: a complete set of settings, the origin of each, and notes about ignored entries.

Read `_specs` (table of all settings), `_values` (one value, from a file or typed), `_file` (a
document: tolerant reading, changes under a lock, its TOML text), `_settings` (documents and
command line together).
`_settings_seal` signs the settings that change a verdict.
The window and `ocmm settings` use it. Commands that measure read one rule alone: released plans
only (decision 74). It must not know a screen nor load a numerical library: the window reads it
first at start.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.settings._file import Note, SettingsFile, toml_text
    from ocmm_core.settings._settings import (
        SETTINGS_NAME, LoadedSettings, SettingOrigin, Settings, SettingsStore, released_plans_only,
    )  # fmt: skip
    from ocmm_core.settings._specs import (
        DEFAULT_SOURCE, RECOMMENDED_RIG, SECTIONS, SETTINGS, STANDARD_PROBE, Applies, Kind, Scope,
        SettingSpec, Value, spec_of,
    )  # fmt: skip
    from ocmm_core.settings._values import text_of, value_of_text
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "DEFAULT_SOURCE", "RECOMMENDED_RIG", "SECTIONS", "SETTINGS", "SETTINGS_NAME", "STANDARD_PROBE",
    "Applies", "Kind", "LoadedSettings", "Note", "Scope", "SettingOrigin", "SettingSpec",
    "Settings", "SettingsFile", "SettingsStore", "Value", "released_plans_only", "spec_of",
    "text_of", "toml_text", "value_of_text",
]  # fmt: skip
