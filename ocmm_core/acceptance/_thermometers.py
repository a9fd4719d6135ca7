"""Temperatures with the uncertainty of a registered thermometer, typed or read by its source."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path

from ocmm_core.acceptance._register import ArtefactEntry, ArtefactRegister
from ocmm_core.acceptance._temperature_drivers import read_source
from ocmm_core.acceptance._temperature_source import TemperatureSource, ThermometerLog
from ocmm_core.calibration.probe_design import Temperature, stated_temperature
from ocmm_core.errors import InputError

_AGAIN_S = 0.25


def read_temperature(
    celsius: float | None, stated: str, now: datetime, folder: Path | None = None
) -> Temperature | None:
    """Return a temperature, typed or read now, with the uncertainty of its thermometer.

    Parameters
    ----------
    celsius
        Typed reading; None if the thermometer is to be read by its source.
    stated
        U (k = 2) in kelvin, or the id of a thermometer in the register; without a typed reading
        also several ids with commas, whose readings must agree. The first one counts.

    Raises
    ------
    InputError
        The uncertainty is missing, a number is implausible, or the thermometer is unknown, expired,
        not certified for that temperature, or its reading is doubtful.
    """
    stated = stated.strip()
    if not stated:
        return stated_temperature(celsius, None)
    try:
        expanded = float(stated.replace(",", "."))
    except ValueError:
        register = ArtefactRegister(folder)
    else:
        return stated_temperature(celsius, expanded)
    names = [stated] if celsius is not None else [name.strip() for name in stated.split(",")]
    entries = [_thermometer(register, name, now) for name in names]
    entry = entries[0]
    if celsius is None:
        celsius = _read_now(entries)
    (low, high), name = entry.temperatures, f"'{entry.name}' (serial {entry.serial})"
    if not low <= celsius <= high:
        raise _useless(
            f"The certificate of {name} covers {low:g} to {high:g} °C, not {celsius:g} °C."
        )
    return stated_temperature(celsius, entry.expanded, f"{entry.name}, serial {entry.serial}")


def thermometer_log(stated: str, now: datetime, folder: Path | None = None) -> ThermometerLog:
    """Return the log of registered thermometers, ids with commas; InputError if unusable."""
    register = ArtefactRegister(folder)
    return _log([_thermometer(register, name.strip(), now) for name in stated.split(",")])


def _log(entries: list[ArtefactEntry]) -> ThermometerLog:
    read: list[tuple[str, str, float, TemperatureSource]] = []
    for one in entries:
        if one.reads is None:
            name = f"'{one.name}' (serial {one.serial})"
            raise InputError(
                "thermometer.no_source",
                f"{name} has no source in the register.",
                "Type its reading, or add its source (docs/acceptance.md).",
            )
        read.append((one.id, f"{one.name}, serial {one.serial}", one.expanded, one.reads))
    return ThermometerLog(read, read_source)


def _read_now(entries: list[ArtefactEntry]) -> float:
    """Return the reading of the first thermometer; InputError if any of them is doubtful."""
    log = _log(entries)
    read = log.sample()
    if all(one.reads is not None and one.reads.kind != "mqtt" for one in entries):
        # A second look: single glitches and numbers that jump.
        time.sleep(_AGAIN_S)
        read = log.sample()
    doubt = next((one.doubt for one in read if one.doubt), "")
    if doubt or read[0].sample is None:
        raise InputError(
            "temperature.doubtful", doubt, "Check the thermometer, or type the temperature."
        )
    return read[0].sample.celsius


def _thermometer(register: ArtefactRegister, known: str, now: datetime) -> ArtefactEntry:
    entry, used = register.entry(known), register.used(known)
    name = f"'{entry.name}' (serial {entry.serial})"
    if entry.kind != "thermometer":
        raise _useless(f"{name} is a {entry.kind}, not a thermometer.")
    if datetime.fromisoformat(used.use.due_utc) <= now:
        raise _useless(f"The certificate of {name} expired on {used.use.due_utc[:10]}.")
    return entry


def _useless(why: str) -> InputError:
    return InputError(
        "temperature.thermometer", why, "Read another calibrated thermometer of the register."
    )
