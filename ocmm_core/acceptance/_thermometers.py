"""Temperatures of registered thermometers, typed or read by their sources.

Sources are a serial line, files of /sys, Modbus/TCP and MQTT. The libraries of the extra
``sensors`` are imported when a source needs them.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import struct
import threading
import time
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.acceptance._register import ArtefactEntry, ArtefactRegister
from ocmm_core.acceptance._temperature_source import TemperatureSource, ThermometerLog
from ocmm_core.calibration.probe_design import Temperature, stated_temperature
from ocmm_core.documents import read_text
from ocmm_core.errors import InputError, StorageError
from ocmm_core.host import HOST
from ocmm_core.plugins import install_line
from ocmm_core.tables import typed_number

_EQUAL = "thermometers.json"
"""Equal readings, next to the register."""
_AGAIN_S = 0.25
_WAIT_S = 3.0
"""Longest wait for an answer of a line or server."""
_MESSAGE_S = 15.0
"""Longest wait for the next MQTT message, which comes when the sensor sends."""
_LONGEST = 4096
_NUMBER = re.compile(r"(?<![\w.+-])[-+]?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?")
"""Not the 1 of "T1"; a unit may follow."""
_COMMA = re.compile(r"(?<![\w.])[0-9]+,[0-9]+(?![0-9.])")
_W1 = re.compile(r"(?:[0-9a-f]{2} ){9}: crc=[0-9a-f]{2} (YES|NO)\n(?:[0-9a-f]{2} ){9}t=(-?[0-9]+)")
"""Two lines of the kernel's w1_therm driver."""
_FORMS = {"int16": ">h", "uint16": ">H", "int32": ">i", "uint32": ">I", "float32": ">f"}
_PORTS = {"modbus": 502, "mqtt": 1883}
_PACKAGES = {"serial": ("serial",), "modbus": ("pymodbus",), "mqtt": ("paho",), "file": ()}


def read_temperature(
    celsius: float | None, stated: str, now: datetime, folder: Path | None = None
) -> Temperature | None:
    """Return a temperature, typed or read now, with the uncertainty of its thermometer.

    `celsius`: typed reading; None to read the thermometer by its source. `stated`: U (k = 2) in
    kelvin, or the id of a thermometer in the register; without a typed reading also several ids
    with commas, whose readings must agree; the first one counts. InputError: the uncertainty is
    missing, a number is implausible, or the thermometer is unknown, expired, not certified for
    that temperature, or its reading is doubtful.
    """
    stated = stated.strip()
    if not stated:
        return stated_temperature(celsius, None)
    expanded = typed_number(stated, comma=False)
    if expanded is not None:
        return stated_temperature(celsius, expanded)
    register = ArtefactRegister(folder)
    names = [stated] if celsius is not None else [name.strip() for name in stated.split(",")]
    entries = [_thermometer(register, name, now) for name in names]
    entry = entries[0]
    if celsius is None:
        celsius = _read_now(entries, register)
    (low, high), name = entry.temperatures, f"'{entry.name}' (serial {entry.serial})"
    if not low <= celsius <= high:
        raise _useless(
            f"The certificate of {name} covers {low:g} to {high:g} °C, not {celsius:g} °C."
        )
    return stated_temperature(celsius, entry.expanded, f"{entry.name}, serial {entry.serial}")


def thermometer_log(stated: str, now: datetime, folder: Path | None = None) -> ThermometerLog:
    """Return the log of registered thermometers, ids with commas; InputError if unusable."""
    register = ArtefactRegister(folder)
    entries = [_thermometer(register, name.strip(), now) for name in stated.split(",")]
    return _log(entries, register)


def _log(entries: list[ArtefactEntry], register: ArtefactRegister) -> ThermometerLog:
    read: list[tuple[str, str, float, TemperatureSource]] = []
    for one in entries:
        if one.reads is None:
            name = f"'{one.name}' (serial {one.serial})"
            raise InputError(
                "thermometer.no_source",
                f"{name} has no source in the register.",
                "Type its reading, or add its source (docs/quality/acceptance.md).",
            )
        read.append((one.id, f"{one.name}, serial {one.serial}", one.expanded, one.reads))
    return ThermometerLog(read, read_source, register.path.with_name(_EQUAL))


def _read_now(entries: list[ArtefactEntry], register: ArtefactRegister) -> float:
    """Return the reading of the first thermometer; InputError if any of them is doubtful."""
    log = _log(entries, register)
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


def read_source(source: TemperatureSource) -> tuple[float, datetime]:
    """Return the present number of a source, unscaled, and its time; InputError without one."""
    wire = source.kind
    for package in _PACKAGES[wire]:
        if importlib.util.find_spec(package) is None:
            raise InputError(
                "thermometer.package",
                f"Thermometers by {wire} need a package that is not installed.",
                f"Install it: {install_line('sensors')}.",
            )
    reader = {"serial": _serial, "file": _file, "modbus": _modbus, "mqtt": _mqtt}[source.kind]
    try:
        return reader(source), datetime.now(UTC)
    except InputError:
        raise
    except Exception as error:  # The libraries raise undocumented exceptions.
        raise _dead(source, str(error).split("\n")[0][:120] or type(error).__name__) from error


def _file(source: TemperatureSource) -> float:
    path = Path(source.address)
    try:
        text = read_text(path, _LONGEST)
    except (InputError, StorageError, OSError) as error:
        raise _dead(source, "the file cannot be read, or the sensor is not connected") from error
    if path.name == "w1_slave":
        found = _W1.fullmatch(text.strip())
        if found is None or found[1] != "YES":
            why = "is not in the format of w1_slave" if found is None else "has a wrong CRC (NO)"
            raise _dead(source, f"its content {why}")
        return float(found[2])
    fault = path.with_name(path.name.replace("_input", "_fault"))
    if fault != path and fault.is_file() and read_text(fault, _LONGEST).strip() != "0":
        raise _dead(source, f"{fault.name} reports a fault of the sensor")
    return _plain(source, text)


def _serial(source: TemperatureSource) -> float:
    import serial

    with serial.Serial(source.address, source.baud, timeout=_WAIT_S) as line:
        line.reset_input_buffer()
        if source.query:
            line.write(source.query.encode("ascii").decode("unicode_escape").encode("latin-1"))
        else:
            # The first line may have started before.
            line.read_until(b"\n", _LONGEST)
        content = line.read_until(b"\n", _LONGEST)
    if not content.endswith(b"\n"):
        raise _dead(source, f"no whole line came within {_WAIT_S:g} s")
    text = content.decode("ascii", errors="replace")
    if _COMMA.search(text):
        raise _dead(source, f"in {text.strip()[:60]!r} a comma is decimal or between two numbers")
    numbers = _NUMBER.findall(text)
    place = int(source.place) - 1
    if place >= len(numbers):
        raise _dead(source, f"its line {text.strip()[:60]!r} has no number {source.place}")
    return float(numbers[place])


def _modbus(source: TemperatureSource) -> float:
    from pymodbus.client import ModbusTcpClient

    host, port = _host(source)
    form = _FORMS[source.form or "int16"]
    client = ModbusTcpClient(host, port=port, timeout=_WAIT_S, retries=0)
    try:
        if not client.connect():  # type: ignore[no-untyped-call] # pymodbus types it in part
            raise _dead(source, "no Modbus server answers")
        read = client.read_input_registers
        if source.table == "holding":
            read = client.read_holding_registers
        count = struct.calcsize(form) // 2
        answer = read(source.register or 0, count=count, device_id=source.device_id)
    finally:
        client.close()  # type: ignore[no-untyped-call] # as above
    if answer.isError() or len(answer.registers) != count:
        raise _dead(source, f"the server refuses register {source.register} ({answer})"[:160])
    return float(struct.unpack(form, struct.pack(f">{count}H", *answer.registers))[0])


def _mqtt(source: TemperatureSource) -> float:
    from paho.mqtt.client import Client, MQTTMessage
    from paho.mqtt.enums import CallbackAPIVersion
    from paho.mqtt.reasoncodes import ReasonCode

    host, port = _host(source)
    came: list[bytes] = []
    retained, refused = False, ""
    done = threading.Event()

    def receive(_client: Client, _data: object, message: MQTTMessage) -> None:
        nonlocal retained
        # Retained: kept by the broker for any time. Brokers may send other topics.
        mine = message.topic == source.topic
        retained = retained or (mine and message.retain)
        if mine and not message.retain:
            came.append(bytes(message.payload))
            done.set()

    def subscribe(to: Client, _data: object, _flags: object, code: ReasonCode, *_: object) -> None:
        nonlocal refused
        if code.is_failure:
            refused = f"the broker refuses this login ({code})"
            done.set()
        to.subscribe(source.topic)

    client = Client(CallbackAPIVersion.VERSION2)
    if source.login:
        client.username_pw_set(*_login(source))
    client.on_message = receive
    client.on_connect = subscribe
    client.connect_timeout = _WAIT_S
    client.connect(host, port)
    client.loop_start()
    try:
        done.wait(min(_MESSAGE_S, source.oldest_s))
    finally:
        client.disconnect()
        client.loop_stop()
    if not came:
        why = "only a retained message, whose time is unknown" if retained else "no message"
        raise _dead(source, refused or f"{why} came on topic '{source.topic}'")
    text = came[0][:_LONGEST].decode("utf-8", errors="replace")
    if not source.place:
        return _plain(source, text)
    value: object = json.loads(text)
    for key in source.place.split("."):
        value = value.get(key) if isinstance(value, dict) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _dead(source, f"its message has no number '{source.place}'")
    return float(value)


def _login(source: TemperatureSource) -> tuple[str, str]:
    """Return user and password for a broker, which no document contains."""
    text = os.environ.get(source.login, "")
    if source.login.startswith("/"):
        path = Path(source.login)
        if HOST.is_open_to(path.stat(), 0o077):
            raise _dead(source, f"others can read the password in {path}, so type chmod 600 {path}")
        text = read_text(path, _LONGEST)
    user, _, password = text.rstrip("\r\n").partition(":")
    if not user or not password:
        raise _dead(source, f"{source.login} holds no user:password")
    return user, password


def _plain(source: TemperatureSource, text: str) -> float:
    try:
        return float(text.strip())
    except ValueError:
        raise _dead(source, f"{text.strip()[:40]!r} is not a number") from None


def _host(source: TemperatureSource) -> tuple[str, int]:
    host, colon, port = source.address.rpartition(":")
    if colon and port.isdecimal():
        return host, int(port)
    return source.address, _PORTS[source.kind]


def _dead(source: TemperatureSource, why: str) -> InputError:
    wire = source.kind
    return InputError(
        "thermometer.dead",
        f"{wire} {source.address}: {why}.",
        "Check the sensor and its entry in the register, or type the temperature.",
    )
