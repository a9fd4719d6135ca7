"""The settings that hold: those shipped, of the station, of the user, and of the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import Enum
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.settings._file import MEASURED, Note, SettingsFile
from ocmm_core.settings._specs import SETTINGS, Scope, Value, spec_of
from ocmm_core.settings._values import checked

_NAME = "settings.toml"
_AHEAD = timedelta(minutes=5)
"""Two clocks may differ by so much before a time counts as one of the future."""


class Origin(Enum):
    """Where a value comes from; a later one wins."""

    DEFAULT = "default"
    STATION = "station"
    USER = "user"
    COMMAND_LINE = "command line"


@dataclass(frozen=True, slots=True)
class Settings:
    """All settings, each with the type of its entry in `SETTINGS`."""

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
    """Settings with where they come from."""

    settings: Settings
    """What holds."""
    values: Mapping[str, Value]
    origins: Mapping[str, Origin]
    """`values`, `origins`: The same by key, and the origin of each."""
    notes: tuple[Note, ...] = ()
    """What was passed over in the documents."""
    too_old: tuple[str, ...] = ()
    """Temperatures that were typed too long ago; they are not in ``settings``."""

    def differs(self, key: str) -> bool:
        """Return whether a setting is another than the one shipped."""
        return self.values[key] != spec_of(key).default


@dataclass(frozen=True, slots=True)
class SettingsStore:
    """Both documents."""

    station: SettingsFile
    user: SettingsFile
    """`station`, `user`: The document for everybody at this computer, and that of this user, which
    wins."""
    given: Mapping[str, Value] = field(default_factory=dict)
    """What the command line says, by key; it wins over both and is never written."""

    @classmethod
    def of_this_user(cls, given: Mapping[str, Value] | None = None) -> SettingsStore:
        """Return the documents where the system keeps such files."""
        import platformdirs

        return cls(
            SettingsFile(platformdirs.site_config_path("ocmm") / _NAME),
            SettingsFile(platformdirs.user_config_path("ocmm") / _NAME),
            given or {},
        )

    def load(self, now: datetime | None = None) -> LoadedSettings:
        """Return what holds; nothing is raised, what cannot be used is in the notes."""
        values: dict[str, Value] = {spec.key: spec.default for spec in SETTINGS}
        origins = dict.fromkeys(values, Origin.DEFAULT)
        notes: list[Note] = []
        stamps: dict[str, str] = {}
        now = now or datetime.now(UTC)
        for file, origin in ((self.station, Origin.STATION), (self.user, Origin.USER)):
            read = file.read()
            notes += read.notes
            for key, value in read.values.items():
                values[key], origins[key] = value, origin
                if key in MEASURED:
                    stamps[key] = read.stamps.get(key, "")
        for key, value in self.given.items():
            values[key], origins[key] = value, Origin.COMMAND_LINE
        valid_h = values["temperature.valid_h"]
        assert isinstance(valid_h, float)  # noqa: S101 - by its entry
        too_old = tuple(
            key
            for key, stamp in stamps.items()
            if origins[key] is not Origin.COMMAND_LINE
            and values[key] is not None
            and not temperatures_hold(stamp, valid_h, now)
        )
        for key in too_old:
            values[key], origins[key] = None, Origin.DEFAULT
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
        """Set values in the document of the station or of the user; return what else was done.

        Parameters
        ----------
        changes
            None, or the default, takes a setting out.
        scope
            None: where each setting belongs. A station document that this user cannot write is
            left; the user's own gets the change, which then holds for this user alone.

        Raises
        ------
        InputError
            A key or a value cannot be used.
        StorageError
            A document cannot be written.
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
            # The station may have set it, too: a default must then stand in the user's document.
            return self._stamped(file, changes, below=self.station)
        if forced:
            return self._stamped(file, changes)
        try:
            notes = self._stamped(file, changes)
        except OcmmError as error:
            held = _set_in(file, changes)
            if any(value is None and key in held for key, value in changes.items()):
                # No document says that something is not set: that of the station would still hold.
                raise
            told = self._stamped(self.user, changes, below=file)
            return (Note(f"{error.what} The change holds for this user.", error.remedy), *told)
        # What the user had set for himself would hide what is now set for everybody.
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
    """Return whether the station, or this user, measures released plans only.

    Commands ask this as well as the window; one document that says so is enough.
    """
    store = SettingsStore.of_this_user()
    files = (store.station, store.user)
    return any(file.read().values.get("job.released_only") is True for file in files)


def _set_in(file: SettingsFile, keys: Iterable[str]) -> frozenset[str]:
    """Return which of these a document sets: its value would come back if the default were left."""
    found = file.read().values
    return frozenset(key for key in keys if key in found)


def temperatures_hold(stamp: str, valid_h: float, now: datetime) -> bool:
    """Return whether temperatures that were typed at a time can still be used.

    Without a time, or with one that is yet to come, nobody knows how old they are.
    """
    try:
        typed = datetime.fromisoformat(stamp)
    except ValueError:
        return False
    if typed.tzinfo is None:
        return False
    return -_AHEAD <= now - typed <= timedelta(hours=valid_h)
