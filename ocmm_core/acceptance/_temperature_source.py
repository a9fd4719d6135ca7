"""Temperature source of a thermometer in the register, and checks of its readings.

Everything about the wire is stated in the register: address, place of the number, unit and scale.
A reading that cannot be trusted is refused with the reason; nothing replaces it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import msgspec

from ocmm_core.ambient import TEMPERATURE
from ocmm_core.documents import decode_json, read_text, write_atomic
from ocmm_core.errors import InputError, StorageError

SourceKind: TypeAlias = Literal["serial", "file", "modbus", "mqtt"]
RegisterForm: TypeAlias = Literal["int16", "uint16", "int32", "uint32", "float32"]
_TO_CELSIUS = {"°C": (0.0, 1.0), "K": (273.15, 1.0), "°F": (32.0, 1.8)}
"""Value at 0 °C, and units per kelvin."""
_POWER_ON_C, _NO_ANSWER_C = 85.0, -127.0
_CONFIRM = 3
"""Readings in a row that end the suspicion after a jump."""
_MOST_BYTES = 1 << 20
_SPACED = 8
"""Number of equal readings to remember within `stuck_s`; more frequent ones count once."""


class TemperatureSource(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where and how a thermometer is read; unit and scale are always stated."""

    kind: SourceKind
    address: str
    """Device of a serial line, path of a file below /sys, or host[:port]."""
    unit: Literal["°C", "K", "°F"]
    scale: float
    """Units per count: 0.001 for files of 1-wire, hwmon and IIO; 1 if the number is in the unit."""
    place: str = ""
    """Serial: which number of the line, from "1". MQTT: keys of a JSON object, "room.air"; empty if
    the message is the number."""
    register: int | None = None
    """Modbus: address of the first register, counted from 0."""
    table: Literal["input", "holding"] = "input"
    form: RegisterForm | None = None
    """Modbus: form of the number; two registers have the high word first."""
    device_id: int = 1
    topic: str = ""
    login: str = ""
    """MQTT: environment variable, or absolute path of a file of mode 0600, with user:password."""
    baud: int = 9600
    query: str = ""
    """Serial: text that is sent to request a line; empty if the device sends lines unasked."""
    oldest_s: float = 60.0
    """Readings older than this are not used."""
    stuck_s: float = 14_400.0
    """Maximum time without any change of the reading."""
    fastest_k_min: float = 1.0
    """Maximum rate of change, K/min."""

    def check(self, where: str) -> None:
        """Raise InputError naming the field that is missing or implausible."""
        wrong = {
            "address": not self.address.strip() or not self.address.isprintable(),
            "scale": not (math.isfinite(self.scale) and 1e-6 <= abs(self.scale) <= 1e3),
            "place": self.kind == "serial" and not (self.place.isdecimal() and int(self.place) > 0),
            "register": (self.register is None) == (self.kind == "modbus")
            or not 0 <= (self.register or 0) <= 0xFFFF,
            "form": (self.form is None) == (self.kind == "modbus"),
            "device_id": not 0 <= self.device_id <= 255,
            "topic": (not self.topic) == (self.kind == "mqtt")
            or any(sign in self.topic for sign in "+#\0"),
            "login": self.login != ""
            and (self.kind != "mqtt" or not (self.login[0] == "/" or self.login.isidentifier())),
            "baud": not 50 <= self.baud <= 4_000_000,
            "oldest_s": not 0.1 <= self.oldest_s <= 3600.0,
            "stuck_s": not 10.0 <= self.stuck_s <= 1e6,
            "fastest_k_min": not 0.01 <= self.fastest_k_min <= 100.0,
        }
        for field, is_wrong in wrong.items():
            if is_wrong:
                # A password may have been typed.
                shown = "(not shown)" if field == "login" else repr(getattr(self, field))
                raise InputError(
                    "thermometer.source",
                    f"{where}: field 'reads.{field}' is {shown}, which does not suit a source of "
                    f"kind '{self.kind}'.",
                    "See docs/quality/acceptance.md for the fields of each kind.",
                )

    def celsius(self, number: float) -> float:
        """Return a read number in degrees Celsius."""
        zero, per_kelvin = _TO_CELSIUS[self.unit]
        return (number * self.scale - zero) / per_kelvin


@dataclass(frozen=True, slots=True)
class TemperatureSample:
    """A number of a source and its time."""

    celsius: float
    utc: Annotated[datetime, msgspec.Meta(tz=True)]


@dataclass(frozen=True, slots=True)
class LoggedTemperature:
    """Newest state of a thermometer."""

    id: str
    name: str
    expanded: float
    """U (k = 2), K."""
    sample: TemperatureSample | None
    """None if it cannot be read."""
    doubt: str
    """Why it must not be used, in a sentence; empty if it may."""

    @property
    def note(self) -> str:
        """Return the reading as it is noted; empty if it must not be used."""
        if self.doubt or self.sample is None:
            return ""
        return f"{self.sample.celsius:.2f} ± {self.expanded:.2f}"


def value_doubt(celsius: float) -> str:
    """Return why a single value cannot be a room temperature; empty if plausible."""
    if not math.isfinite(celsius):
        return "is not a number"
    if round(celsius, 3) == _POWER_ON_C:
        return "is 85 °C, the power-on value of a DS18B20, which did not convert: check its supply"
    if round(celsius, 3) == _NO_ANSWER_C:
        return "is -127 °C, the value of a 1-wire sensor that does not answer"
    if celsius not in TEMPERATURE:
        return f"is {celsius:.2f} °C, outside {TEMPERATURE.least:g} to {TEMPERATURE.most:g} °C"
    return ""


def history_doubt(
    source: TemperatureSource, expanded: float, samples: Sequence[TemperatureSample]
) -> str:
    """Return why the newest of consecutive samples must not be used; empty if it may."""
    newest = samples[-1]
    if found := value_doubt(newest.celsius):
        return found
    recent = samples[-_CONFIRM - 1 :]
    for before, after in pairwise(recent):
        minutes = max(0.0, (after.utc - before.utc).total_seconds()) / 60.0
        moved = after.celsius - before.celsius
        if abs(moved) > expanded + source.fastest_k_min * minutes:
            return f"jumped by {moved:+.2f} K within {60.0 * minutes:.0f} s"
    return ""


class ThermometerLog:
    """Readings of thermometers over time.

    `thermometers`: id, name with serial number, U (k = 2) in kelvin, and source of each. `read`:
    returns the present number of a source and its time; raises InputError. `memory`: file with
    the equal readings of earlier programs, which reveal a value that a dead sensor or its gateway
    repeats; None to forget them.
    """

    def __init__(
        self,
        thermometers: Sequence[tuple[str, str, float, TemperatureSource]],
        read: Callable[[TemperatureSource], tuple[float, datetime]],
        memory: Path | None = None,
    ) -> None:
        self._thermometers = tuple(thermometers)
        self._read, self._memory = read, memory
        self._samples: dict[str, deque[TemperatureSample]] = {
            one[0]: deque(maxlen=_CONFIRM + 1) for one in thermometers
        }
        self._equal = _equal_readings(memory)

    def sample(self, clock: Callable[[], datetime] = lambda: datetime.now(UTC)) -> tuple[
        LoggedTemperature, ...
    ]:  # fmt: skip
        """Read all thermometers and compare them."""
        found = [self._one(*each, clock) for each in self._thermometers]
        apart = disagreement([one for one in found if not one.doubt])
        return tuple(replace(one, doubt=one.doubt or apart) for one in found)

    def _one(
        self, key: str, name: str, expanded: float, source: TemperatureSource,
        clock: Callable[[], datetime],
    ) -> LoggedTemperature:  # fmt: skip
        samples = self._samples[key]
        try:
            number, utc = self._read(source)
        except InputError as error:
            return LoggedTemperature(key, name, expanded, None, f"Thermometer {name}: {error.what}")
        sample = TemperatureSample(source.celsius(number), utc)
        samples.append(sample)
        age = clock() - utc
        doubt = history_doubt(source, expanded, list(samples)) or self._stuck(key, source, sample)
        if not doubt and not -timedelta(seconds=5) <= age <= timedelta(seconds=source.oldest_s):
            doubt = f"is {age.total_seconds():.0f} s old, more than {source.oldest_s:g} s"
        if doubt:
            doubt = f"Thermometer {name}: its reading {doubt}."
        return LoggedTemperature(key, name, expanded, sample, doubt)

    def _stuck(self, key: str, source: TemperatureSource, sample: TemperatureSample) -> str:
        """Remember a sample; return why it repeats an old value, empty if it need not."""
        equal = self._equal.get(key, ())
        # Also if the clock was set back.
        if equal and (sample.celsius != equal[-1].celsius or sample.utc < equal[-1].utc):
            equal = ()
        spaced = timedelta(seconds=source.stuck_s / _SPACED)
        if not equal or sample.utc - equal[-1].utc >= spaced:
            equal = (*equal[: 2 * _SPACED], sample)
            self._equal = {**self._equal, **_equal_readings(self._memory), key: equal}
            if self._memory is not None:
                with suppress(OSError):
                    write_atomic(self._memory, msgspec.json.encode(self._equal))
        seconds = (sample.utc - equal[0].utc).total_seconds()
        if seconds < source.stuck_s or len(equal) <= _CONFIRM:
            return ""
        since = f"{equal[0].utc:%Y-%m-%d %H:%M}"
        return f"has been {sample.celsius:g} °C to the last digit since {since} UTC"


def _equal_readings(memory: Path | None) -> dict[str, tuple[TemperatureSample, ...]]:
    """Return the newest equal readings by thermometer, oldest first; empty if unreadable."""
    with suppress(InputError, StorageError, OSError, msgspec.MsgspecError):
        if memory is not None:
            text = read_text(memory, _MOST_BYTES)
            return decode_json(text, dict[str, tuple[TemperatureSample, ...]])
    return {}


def disagreement(read: Sequence[LoggedTemperature]) -> str:
    """Return the sentence for readings that contradict each other; empty if they agree."""
    known = [(one, one.sample.celsius) for one in read if one.sample is not None]
    if len(known) < 2:
        return ""
    low, high = min(known, key=lambda one: one[1]), max(known, key=lambda one: one[1])
    if high[1] - low[1] <= math.hypot(low[0].expanded, high[0].expanded):
        return ""
    return (
        f"Thermometers {low[0].name} ({low[1]:.2f} °C) and {high[0].name} ({high[1]:.2f} °C) "
        "differ by more than their uncertainties: compare them side by side."
    )
