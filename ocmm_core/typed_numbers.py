"""Numbers that people type: unit and range of each, in one table.

Forms of the window, commands and procedures check here, so that none of them accepts a number that
another refuses. Readings of a room, which may be ranges, are in `ocmm_core.ambient`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ocmm_core import ambient
from ocmm_core.ambient import Quantity
from ocmm_core.errors import InputError
from ocmm_core.tables import typed_number
from ocmm_core.units import find_unit, scaled

_WITH_UNIT = re.compile(r"(?P<number>.*?[\d.,])?\s*(?P<unit>[^\d\s.,+-]\D*)")


@dataclass(frozen=True, slots=True)
class NumberField:
    """One number of a form."""

    quantity: Quantity
    words: str
    """Noun of a sentence."""
    whole: bool = False

    def check(self, value: float) -> float:
        """Return a number within its range; raise InputError otherwise, also for nan."""
        if value not in self.quantity or (self.whole and value != int(value)):
            given = f"{value:g} {self.quantity.unit}".strip()
            raise self._refusal(f"The typed {self.words} is {given}.")
        return value

    def read(self, text: str, *, comma: bool = False) -> float:
        """Return a typed number, with or without its unit; a length may be in inch.

        ``comma``: the form shows numbers with a decimal comma; see `tables.typed_number`.
        InputError if it is no number, ambiguous, in another unit, or out of range.
        """
        found = _WITH_UNIT.fullmatch(text.strip())
        typed, named = (found["number"], found["unit"]) if found else (text, "")
        value = typed_number(typed or text, comma=comma)
        if value == 0.0 and re.search("[1-9]", re.split("[eEdD]", typed or text)[0]):
            value = None  # "1e-400" is not zero
        given = repr(text.strip()[:40])
        if value is None:
            raise self._refusal(f"The typed {self.words} is {given}, which is not a number.")
        if named and named != self.quantity.unit:
            unit = find_unit(named, "length") if self.quantity.unit == "mm" else None
            if unit is None:
                raise self._refusal(f"The typed {self.words} is {given}, which is in another unit.")
            value = scaled(value, unit.factor)
        return self.check(value)

    def _refusal(self, what: str) -> InputError:
        """Return the error of a number that is not one of this field."""
        one = self.quantity
        kind = "whole number" if self.whole else "number"
        unit = f" {one.unit}" if one.unit else ""
        return InputError(
            f"number.{one.field}", what, f"Enter a {kind} from {one.least:g} to {one.most:g}{unit}."
        )


def _field(name: str, unit: str, least: float, most: float, words: str) -> NumberField:
    return NumberField(Quantity(name, unit, least, most), words)


def _whole(name: str, least: int, most: int, words: str, unit: str = "") -> NumberField:
    return NumberField(Quantity(name, unit, least, most), words, whole=True)


TEMPERATURE = NumberField(ambient.TEMPERATURE, "temperature")
BALL = _field("ball", "mm", 0.1, 100.0, "ball diameter")
REFERENCE = _field("reference", "mm", 1e-4, 1e5, "reference length")
PARTS = _whole("parts", 1, 1000, "number of parts")
TRIALS = _whole("trials", 1, 100, "number of trials")
SEED = NumberField(Quantity("seed", "", 0, 2**31), "seed", whole=True)
TILT = _field("tilt", "°", 0.0, 180.0, "tilt")
SPOT_NOISE = _field("noise", "px", 1e-4, 10.0, "noise of spots")
COORDINATE = _field("coordinate", "", -1e6, 1e6, "number")
EXPANDED = _field("expanded", "mm", 0.0, 100.0, "uncertainty")
PER_LENGTH = _field("per-length", "", 0.0, 0.01, "part per length")
FORM = _field("form", "mm", 0.0, 100.0, "form error")
EXPANSION = _field("expansion", "1/K", -1e-5, 1e-4, "thermal expansion")
EXPANSION_SIGMA = _field("expansion-sigma", "1/K", 0.0, 1e-4, "uncertainty of the expansion")
SIZE = _field("size", "mm", 0.0, 1e5, "size")
TEMPERATURE_SIGMA = _field("temperature-sigma", "K", 0.01, 10.0, "uncertainty of the temperature")
PLACEMENTS = _whole("placements-tried", 0, 1_000_000, "number of placements")
ZONE = _field("zone", "mm", 0.001, 1000.0, "width of the zone")

NUMBER_FIELDS = (
    TEMPERATURE, BALL, REFERENCE, PARTS, TRIALS, SEED, TILT, SPOT_NOISE, COORDINATE, EXPANDED,
    PER_LENGTH, FORM, EXPANSION, EXPANSION_SIGMA, SIZE, ZONE, TEMPERATURE_SIGMA,
    _whole("workers", 1, 1024, "number of processes"),
    _whole("simulated-trials", 10_000, 100_000_000, "number of trials"),
    _whole("digits", 1, 2, "number of digits"),
    _whole("processor", 0, 1023, "processor"),
    _whole("port", 0, 65535, "port"),
    _whole("fixed-port", 1, 65535, "port"),
    _whole("zoom", 80, 200, "size", unit="%"),
    _whole("volume", 5, 100, "size", unit="%"),
    _field("ruler", "mm", 15.0, 600.0, "size"),
    _whole("baud", 300, 4_000_000, "speed of the serial line", unit="baud"),
    _whole("megabytes", 1, 2048, "size", unit="MB"),
    _whole("cameras", 0, 4, "number of cameras"),
    _whole("frames", 1, 4096, "number of frames"),
    _whole("serial", 0, 2**32 - 1, "serial number"),
    _field("exposure", "µs", 0.1, 10_000_000.0, "exposure time"),
    _field("gain", "", 0.0, 10_000.0, "gain"),
    _whole("alias", 1, 65535, "station alias"),
    _whole("points", 0, 10_000, "number of points"),
    _whole("poses", 20, 1_000_000, "number of poses"),
    _whole("poses-of-a-probe", 100, 1_000_000, "number of poses"),
    _whole("placements", 1, 1000, "number of placements"),
    _whole("days", 1, 3650, "number of days"),
    _whole("runs", 1, 1_000_000, "number of runs"),
    PLACEMENTS,
    _whole("runs-of-a-study", 2, 1_000_000, "number of runs"),
    _whole("rows", 1, 10_000_000, "number of rows"),
    _whole("measurements", 0, 10_000_000, "number of measurements"),
    _field("step", "", 1e-9, 1000.0, "step of a coordinate"),
    _whole("cycle", 1, 10**9, "bus cycle", unit="ns"),
    _whole("nanoseconds", 0, 10**9, "time", unit="ns"),
    _field("seconds", "s", 0.1, 86_400.0, "time"),
    _whole("touches", 1, 1000, "number of touches"),
    _field("seconds-of-a-bench", "s", 0.2, 3600.0, "time"),
    _field("seconds-of-a-capture", "s", 0.1, 3600.0, "time"),
    _field("seconds-of-frames", "s", 0.2, 86_400.0, "time"),
    _field("seconds-of-rest", "s", 10.0, 86_400.0, "time"),
    _field("seconds-of-a-doctor", "s", 0.0, 86_400.0, "time"),
    _whole("seconds-of-a-lamp", 1, 600, "time", unit="s"),
    _field("minutes", "min", 0.0, 10_000.0, "time"),
    _field("hours-between-checks", "h", 0.1, 168.0, "time"),
    _field("hours-of-validity", "h", 0.1, 24.0, "time"),
    _field("hours", "h", 0.0, 8760.0, "time"),
    _field("speed", "", 0.0, 1000.0, "speed"),
    _field("limit", "mm", 0.0, 10.0, "limit"),
    _field("target-noise", "µm", 0.0, 1e4, "noise of targets"),
    _field("turn", "°", -360.0, 360.0, "turn"),
    _field("part-expansion", "1e-6/K", -200.0, 200.0, "thermal expansion"),
    _field("level", "", 0.0, 1.0, "p-value"),
    _field("certified", "mm", -1e5, 1e5, "certified value"),
)  # fmt: skip

_BY_NAME = {field.quantity.field: field for field in NUMBER_FIELDS}


def number_field(name: str) -> NumberField:
    """Return the field of a name; KeyError if it is not listed."""
    return _BY_NAME[name]
