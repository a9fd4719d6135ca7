"""Effective settings: defaults, station, user and command line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import Enum
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.settings._file import MEASURED, Note, SettingsFile
from ocmm_core.settings._settings_seal import remembers_released_only
from ocmm_core.settings._specs import SETTINGS, Scope, Value, spec_of
from ocmm_core.settings._values import checked

SETTINGS_NAME = "settings.toml"
_AHEAD = timedelta(minutes=5)
"""Tolerated clock difference before a time counts as in the future."""


class SettingOrigin(Enum):
    """Origin of a value; later ones win."""

    DEFAULT = "default"
    STATION = "station"
    USER = "user"
    COMMAND_LINE = "command line"


@dataclass(frozen=True, slots=True)
class Settings:
    """All settings, typed as their entries in `SETTINGS`."""

    instrument_source: str
    instrument_rig: Path
    instrument_probe: Path
    instrument_tip: str | None
    instrument_reference: Path | None
    instrument_calibrations: Path | None
    instrument_probes: Path | None
    instrument_check_after_h: float
    instrument_bus_processor: int | None
    job_folder: Path
    job_rescue: Path | None
    job_plans: Path | None
    job_released_only: bool
    job_operator: str
    job_operators: tuple[str, ...]
    temperature_part_c: float | None
    temperature_part_expansion_ppm: float | None
    temperature_compensate_part: bool
    temperature_probe_c: float | None
    temperature_probe_design: Path | None
    temperature_compensate_probe: bool
    temperature_sigma_k: float | None
    temperature_thermometer: str
    temperature_valid_h: float
    report_laboratory: str
    report_address: tuple[str, ...]
    report_logo: Path | None
    report_contact: str
    report_accreditation: str
    report_country: str
    report_place: str
    report_machine: str
    report_machine_serial: str
    report_machine_inventory: str
    report_signatures: tuple[str, ...]
    report_formats: tuple[str, ...]
    report_template: Path | None
    report_language: str
    report_units: str
    stream_port: int | None
    stream_host: str
    stream_token: Path | None
    stream_certificate: Path | None
    stream_key: Path | None
    serve_dialect: str
    serve_host: str
    serve_port: int
    serve_allow: tuple[str, ...]
    serve_shift_sign: str
    serve_point: str
    screen_host: str
    screen_port: int
    screen_control: bool
    archive_address: str
    archive_station: str
    archive_password: Path | None
    window_language: str
    window_decimal: str
    window_units: str
    window_theme: str
    window_zoom: int
    window_gloves: bool
    window_ruler_mm: float | None
    window_sounds: bool
    window_volume: int
    window_far: bool
    window_keys: dict[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class LoadedSettings:
    """Effective settings with their origins."""

    settings: Settings
    values: Mapping[str, Value]
    origins: Mapping[str, SettingOrigin]
    """`values`, `origins`: Value and origin by key."""
    notes: tuple[Note, ...] = ()
    """Ignored entries of the documents."""
    too_old: tuple[str, ...] = ()
    """Temperatures typed too long ago; absent from ``settings``."""

    def differs(self, key: str) -> bool:
        """Return whether a setting differs from the shipped default."""
        return self.values[key] != spec_of(key).default


@dataclass(frozen=True, slots=True)
class SettingsStore:
    """Settings documents of the station and of the user."""

    station: SettingsFile
    user: SettingsFile
    """`station`, `user`: For all users of this computer, and for this user, which wins."""
    given: Mapping[str, Value] = field(default_factory=dict)
    """Command-line values by key; they win over both and are never written."""

    @classmethod
    def of_this_user(cls, given: Mapping[str, Value] | None = None) -> SettingsStore:
        """Return the documents in the system's folders."""
        import platformdirs

        return cls(
            SettingsFile(platformdirs.site_config_path("ocmm") / SETTINGS_NAME),
            SettingsFile(platformdirs.user_config_path("ocmm") / SETTINGS_NAME),
            given or {},
        )

    def places(self) -> str:
        """Return which document changes are written to, and whom they apply to."""
        folder = next(one for one in self.station.path.parents if one.exists())
        if os.access(folder, os.W_OK):
            return f"Files: {self.station.path} for all users, {self.user.path} for you."
        return f"File, for you only: {self.user.path}."

    def load(self, now: datetime | None = None) -> LoadedSettings:
        """Return the effective settings; never raises, unusable entries are in the notes."""
        values: dict[str, Value] = {spec.key: spec.default for spec in SETTINGS}
        origins = dict.fromkeys(values, SettingOrigin.DEFAULT)
        notes: list[Note] = []
        stamps: dict[str, str] = {}
        now = now or datetime.now(UTC)
        for file, origin in (
            (self.station, SettingOrigin.STATION),
            (self.user, SettingOrigin.USER),
        ):
            read = file.read()
            notes += read.notes
            for key, value in read.values.items():
                values[key], origins[key] = value, origin
                if key in MEASURED:
                    stamps[key] = read.stamps.get(key, "")
        for key, value in self.given.items():
            values[key], origins[key] = value, SettingOrigin.COMMAND_LINE
        valid_h = values["temperature.valid_h"]
        assert isinstance(valid_h, float)  # noqa: S101 - by its entry
        too_old = tuple(
            key
            for key, stamp in stamps.items()
            if origins[key] is not SettingOrigin.COMMAND_LINE
            and values[key] is not None
            and not temperatures_hold(stamp, valid_h, now)
        )
        for key in too_old:
            values[key], origins[key] = None, SettingOrigin.DEFAULT
            notes.append(
                Note(
                    f"{spec_of(key).label}: what was typed is older than {valid_h:g} h, or says "
                    "no time, and is not used.",
                    "Measure it and type it again in Settings.",
                )
            )
        fields = {key.replace(".", "_"): value for key, value in values.items()}
        settings = Settings(**fields)  # type: ignore[arg-type] # a test holds both together
        return LoadedSettings(settings, values, origins, tuple(notes), too_old)

    def change(self, changes: Mapping[str, Value], scope: Scope | None = None) -> tuple[Note, ...]:
        """Set values in the documents; return side effects as notes.

        None, or the default, removes a setting. ``scope`` None: the default scope of each; if this
        user cannot write the station document, the user's own gets the change. InputError for
        unusable keys or values; StorageError if a document cannot be written.
        """
        notes: list[Note] = []
        for group in (Scope.STATION, Scope.USER):
            mine = {
                key: value
                for key, value in changes.items()
                if (scope or spec_of(key).scope) is group
            }
            if mine:
                notes += self._change(group, mine, forced=scope is not None)
        return tuple(notes)

    def _change(
        self, scope: Scope, changes: Mapping[str, Value], *, forced: bool
    ) -> tuple[Note, ...]:
        for key, value in changes.items():
            if value is not None:
                checked(spec_of(key), value)
        file = self.station if scope is Scope.STATION else self.user
        if scope is Scope.USER:
            # The station may have set it also: the user's document must then contain the default.
            return self._stamped(file, changes, below=self.station)
        if forced:
            return self._stamped(file, changes)
        try:
            notes = self._stamped(file, changes)
        except OcmmError as error:
            held = _set_in(file, changes)
            if any(value is None and key in held for key, value in changes.items()):
                # Documents cannot express "not set": the station's value would remain in effect.
                raise
            told = self._stamped(self.user, changes, below=file)
            return (Note(f"{error.what} The change holds for this user.", error.remedy), *told)
        # The user's own value would hide the new station value.
        hidden = [key for key in changes if key in self.user.read().values]
        if hidden:
            notes += self.user.change(dict.fromkeys(hidden))
        return notes

    def _stamped(
        self, file: SettingsFile, changes: Mapping[str, Value], below: SettingsFile | None = None
    ) -> tuple[Note, ...]:
        return file.change(
            changes,
            stamp=datetime.now(UTC).isoformat(timespec="seconds"),
            keep_defaults=_set_in(below, changes) if below is not None else frozenset(),
        )


def released_plans_only() -> bool:
    """Return whether the station or this user measures released plans only.

    A lost or replaced document does not end it; StorageError if the memory is damaged.
    """
    store = SettingsStore.of_this_user()
    for file in (store.station, store.user):
        now = file.read()
        if now.values.get("job.released_only") is True or remembers_released_only(
            file.path, now.entries
        ):
            return True
    return False


def _set_in(file: SettingsFile, keys: Iterable[str]) -> frozenset[str]:
    """Return the keys that a document sets: with the default omitted, its value would win."""
    found = file.read().values
    return frozenset(key for key in keys if key in found)


def temperatures_hold(stamp: str, valid_h: float, now: datetime) -> bool:
    """Return whether typed temperatures are valid; not with missing, naive or future stamps."""
    try:
        typed = datetime.fromisoformat(stamp)
    except ValueError:
        return False
    return typed.tzinfo is not None and -_AHEAD <= now - typed <= timedelta(hours=valid_h)
