"""Readers of temperature sources: serial line, files of /sys, Modbus/TCP and MQTT.

The libraries of the extra ``sensors`` are imported when a source needs them.
"""

from __future__ import annotations

import importlib.util
import json
import re
import struct
import threading
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.acceptance._temperature_source import TemperatureSource
from ocmm_core.documents import read_text
from ocmm_core.errors import InputError, StorageError

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


def read_source(source: TemperatureSource) -> tuple[float, datetime]:
    """Return the present number of a source, unscaled, and its time.

    Raises
    ------
    InputError
        It cannot be read, or gives no number; the sentence names the source and the reason.
    """
    wire = source.kind
    for package in _PACKAGES[wire]:
        if importlib.util.find_spec(package) is None:
            raise InputError(
                "thermometer.package",
                f"Thermometers by {wire} need a package that is not installed.",
                "Install the extra `sensors`: ./run setup --sensors",
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
        if source.query:
            line.reset_input_buffer()
            line.write(source.query.encode("ascii").decode("unicode_escape").encode("latin-1"))
        else:
            # The first line may have started before.
            line.reset_input_buffer()
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

    host, port = _host(source)
    came: list[bytes] = []
    retained = False
    done = threading.Event()

    def take(_client: Client, _data: object, message: MQTTMessage) -> None:
        nonlocal retained
        if message.topic != source.topic:
            return
        if message.retain:
            # Kept by the broker for any time.
            retained = True
            return
        came.append(bytes(message.payload))
        done.set()

    def subscribe(to: Client, *_: object) -> None:
        to.subscribe(source.topic)

    client = Client(CallbackAPIVersion.VERSION2)
    client.on_message = take
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
        raise _dead(source, f"{why} came on topic '{source.topic}'")
    text = came[0][:_LONGEST].decode("utf-8", errors="replace")
    if not source.place:
        return _plain(source, text)
    value: object = json.loads(text)
    for key in source.place.split("."):
        value = value.get(key) if isinstance(value, dict) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _dead(source, f"its message has no number '{source.place}'")
    return float(value)


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
