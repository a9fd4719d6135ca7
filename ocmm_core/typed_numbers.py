"""Numbers that people type: unit and range of each, in one table.

Forms of the window, commands and procedures check here, so that none of them accepts a number that
another refuses. Readings of a room, which may be ranges, are in `ocmm_core.surroundings`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ocmm_core import surroundings
from ocmm_core.errors import InputError
from ocmm_core.surroundings import Quantity
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
    options: tuple[str, ...] = ()
    """Options of commands: ``--seed`` of all, ``bench/--seconds`` of one."""

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


def _field(
    name: str, unit: str, least: float, most: float, words: str, *options: str
) -> NumberField:
    return NumberField(Quantity(name, unit, least, most), words, options=options)


def _whole(
    name: str, least: int, most: int, words: str, *options: str, unit: str = ""
) -> NumberField:
    return NumberField(Quantity(name, unit, least, most), words, True, options)


TEMPERATURE = NumberField(
    surroundings.TEMPERATURE, "temperature",
    options=("--temperature", "--probe-temperature", "--part-temperature", "--temperatures"),
)  # fmt: skip
BALL = _field("ball", "mm", 0.1, 100.0, "ball diameter", "--ball", "--diameter")
REFERENCE = _field("reference", "mm", 1e-4, 1e5, "reference length", "--reference", "--tolerance")
PARTS = _whole("parts", 1, 1000, "number of parts", "--parts")
TRIALS = _whole("trials", 1, 100, "number of trials", "msa/plan/--trials")
SEED = NumberField(Quantity("seed", "", 0, 2**31), "seed", True, ("--seed", "--move"))
TILT = _field("tilt", "°", 0.0, 180.0, "tilt", "--tilt", "--range")
SPOT_NOISE = _field("noise", "px", 1e-4, 10.0, "noise of spots", "--spot-sigma")
COORDINATE = _field("coordinate", "", -1e6, 1e6, "number")
EXPANDED = _field("expanded", "mm", 0.0, 100.0, "uncertainty", "--U", "--U-cal", "--u-workpiece")
PER_LENGTH = _field(
    "per-length", "", 0.0, 0.01, "part per length", "--U-per-length", "--limit-per-length"
)
FORM = _field("form", "mm", 0.0, 100.0, "form error", "--form")
EXPANSION = _field("expansion", "1/K", -1e-5, 1e-4, "thermal expansion", "--expansion")
EXPANSION_SIGMA = _field(
    "expansion-sigma", "1/K", 0.0, 1e-4, "uncertainty of the expansion", "--expansion-sigma",
    "--expansion-u", "--u-expansion",
)  # fmt: skip
SIZE = _field("size", "mm", 0.0, 1e5, "size", "--size", "plan/import/--least", "plan/import/--most")
ZONE = _field("zone", "mm", 0.001, 1000.0, "width of the zone", "--profile")
TEMPERATURE_SIGMA = _field(
    "temperature-sigma", "K", 0.0, 10.0, "uncertainty of the temperature", "--temperature-sigma"
)

NUMBER_FIELDS = (
    TEMPERATURE, BALL, REFERENCE, PARTS, TRIALS, SEED, TILT, SPOT_NOISE, COORDINATE, EXPANDED,
    PER_LENGTH, FORM, EXPANSION, EXPANSION_SIGMA, SIZE, ZONE, TEMPERATURE_SIGMA,
    _whole("workers", 1, 1024, "number of processes", "--workers", "--processes"),
    _whole("simulated-trials", 10_000, 100_000_000, "number of trials", "uncertainty/--trials"),
    _whole("digits", 1, 2, "number of digits", "--digits"),
    _whole("processor", 0, 1023, "processor", "--bus-processor"),
    _whole("port", 0, 65535, "port", "--stream", "--port"),
    _whole("megabytes", 1, 2048, "size", "--megabytes", unit="MB"),
    _whole("cameras", 0, 4, "number of cameras", "--cameras"),
    _whole("frames", 1, 4096, "number of frames", "--frames"),
    _whole("serial", 0, 2**32 - 1, "serial number", "--serial"),
    _whole("alias", 1, 65535, "station alias", "camera/alias/value"),
    _whole("points", 0, 10_000, "number of points", "--evaluation"),
    _whole("poses", 20, 1_000_000, "number of poses", "--poses"),
    _whole("poses-of-a-probe", 100, 1_000_000, "number of poses", "calibrate/probe/--poses",
           "probe/design/--poses"),
    _whole("placements", 1, 1000, "number of placements", "--placements"),
    _whole("days", 1, 3650, "number of days", "--valid-days"),
    _whole("runs", 1, 1_000_000, "number of runs", "--runs"),
    _whole("runs-of-a-study", 2, 1_000_000, "number of runs", "study/coverage/--runs"),
    _whole("rows", 1, 10_000_000, "number of rows", "--most"),
    _whole("measurements", 0, 10_000_000, "number of measurements", "msa/run/--most"),
    _field("step", "", 1e-9, 1000.0, "step of a coordinate", "camera/describe/--step"),
    _whole("cycle", 1, 10**9, "bus cycle", "camera/describe/--cycle-ns", unit="ns"),
    _whole("nanoseconds", 0, 10**9, "time", "camera/describe/--doubt-ns",
           "camera/describe/--latency-ns", unit="ns"),
    _field("seconds", "s", 0.1, 86_400.0, "time", "--seconds", "--patience"),
    _whole("touches", 1, 1000, "number of touches", "--tries"),
    _field("seconds-of-a-bench", "s", 0.2, 3600.0, "time", "bench/--seconds"),
    _field("seconds-of-a-capture", "s", 0.1, 3600.0, "time", "bus/record/--seconds"),
    _field("seconds-of-frames", "s", 0.2, 86_400.0, "time", "bus/watch/--seconds",
           "bus/watch/--every"),
    _field("seconds-of-rest", "s", 10.0, 86_400.0, "time", "calibrate/sensors/--seconds"),
    _field("seconds-of-a-doctor", "s", 0.0, 86_400.0, "time", "station/doctor/--seconds",
           "--quit-after"),
    _whole("seconds-of-a-lamp", 1, 600, "time", "camera/identify/--seconds", unit="s"),
    _field("minutes", "min", 0.0, 10_000.0, "time", "bench/--memory"),
    _field("hours", "h", 0.0, 8760.0, "time", "--hours", "--check-after"),
    _field("speed", "", 0.0, 1000.0, "speed", "--speed"),
    _field("limit", "mm", 0.0, 10.0, "limit", "--limit", "--limit-largest", "--limit-diameter",
           "--limit-form", "--relocate", "--slack"),
    _field("target-noise", "µm", 0.0, 1e4, "noise of targets", "--sigma"),
    _field("turn", "°", -360.0, 360.0, "turn", "--turn"),
    _field("part-expansion", "1e-6/K", -200.0, 200.0, "thermal expansion", "--part-expansion"),
    _field("level", "", 0.0, 1.0, "p-value", "--level"),
    _field("certified", "mm", -1e5, 1e5, "certified value", "--certified"),
)  # fmt: skip


def option_field(command: str, option: str) -> NumberField | None:
    """Return the field of an option: of its command, else of all commands; None if not listed."""
    for name in (f"{command} {option}".replace(" ", "/"), option):
        for field in NUMBER_FIELDS:
            if name in field.options:
                return field
    return None
