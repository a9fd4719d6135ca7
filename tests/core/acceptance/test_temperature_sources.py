"""Logged temperatures: real lines and servers, and sources that lie."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import os
import pty
import socket
import threading
import time
import warnings
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import msgspec
import pytest

from ocmm_core.acceptance import (
    ARTEFACT_SCHEMA,
    ArtefactEntry,
    ArtefactRegister,
    TemperatureSource,
    ThermometerLog,
    load_artefact,
    read_temperature,
    thermometer_log,
)
from ocmm_core.acceptance._temperature_source import TemperatureSample, history_doubt, value_doubt
from ocmm_core.acceptance._thermometers import read_source
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.errors import InputError
from tests.host import needs_package

NOW = datetime.now(UTC)
W1 = "4b 46 7f ff 0c 10 {:02x} 00 64 : crc=64 {}\n4b 46 7f ff 0c 10 {:02x} 00 64 t={}\n"


def file_source(path: Path, **changes: object) -> TemperatureSource:
    given: dict[str, Any] = {
        "kind": "file", "address": str(path), "unit": "°C", "scale": 0.001, **changes
    }  # fmt: skip
    return TemperatureSource(**given)


def registered(folder: Path, name: str, source: TemperatureSource | None) -> None:
    ArtefactRegister(folder).add(
        ArtefactEntry(
            schema=ARTEFACT_SCHEMA, unit="mm", id=name, kind="thermometer", name=f"room {name}",
            serial="4711", laboratory="lab", certificate="C-9", due_utc="2040-01-01T00:00:00+00:00",
            sizes=(), expanded=0.2, expansion=0.0, expansion_sigma=0.0, temperatures=(15.0, 25.0),
            reads=source,
        ),
        "Ann", NOW,
    )  # fmt: skip


@pytest.fixture
def w1(tmp_path: Path) -> Path:
    """Return a file in the format of the kernel's w1_therm driver, laid out like /sys."""
    path = tmp_path / "sys" / "bus" / "w1" / "devices" / "28-000005e2fdc3" / "w1_slave"
    path.parent.mkdir(parents=True)
    path.write_text(W1.format(16, "YES", 16, 20437))
    return path


def test_register_keeps_a_source_and_reads_it(tmp_path: Path, w1: Path) -> None:
    registered(tmp_path, "T-1", file_source(w1))
    read = read_temperature(None, "T-1", NOW, tmp_path)
    assert read == Temperature(20.437, 0.1, "room T-1, serial 4711")
    # A typed number has priority, and a document states the same source.
    assert read_temperature(21.0, "T-1", NOW, tmp_path) == Temperature(
        21.0, 0.1, "room T-1, serial 4711"
    )
    document = tmp_path / "t.toml"
    text = msgspec.json.encode(ArtefactRegister(tmp_path).entry("T-1"))
    given = {key: value for key, value in json.loads(text).items() if key != "reads"}
    reads = {"kind": "file", "address": str(w1), "unit": "°C", "scale": 0.001}
    lines = [f"{key} = {json.dumps(value)}" for key, value in given.items()]
    lines += ["[reads]", *(f"{key} = {json.dumps(value)}" for key, value in reads.items())]
    document.write_text("\n".join(lines), encoding="utf-8")
    assert load_artefact(document).reads == file_source(w1)
    # A new certificate keeps the source.
    register = ArtefactRegister(tmp_path)
    renewed = msgspec.structs.replace(register.entry("T-1"), certificate="C-10", reads=None)
    register.add(renewed, "Ann", NOW, replace=True)
    assert ArtefactRegister(tmp_path).entry("T-1").reads == file_source(w1)


def test_typed_number_is_asked_for_without_a_source(tmp_path: Path) -> None:
    registered(tmp_path, "T-1", None)
    with pytest.raises(InputError, match="has no source in the register"):
        read_temperature(None, "T-1", NOW, tmp_path)
    assert read_temperature(None, "", NOW, tmp_path) is None


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (W1.format(16, "NO", 16, 20437), "wrong CRC"),
        (W1.format(16, "YES", 16, 85000), "power-on value of a DS18B20"),
        (W1.format(16, "YES", 16, -127000), "does not answer"),
        (W1.format(16, "YES", 16, 61000), "outside 0 to 50"),
        (W1.format(16, "YES", 16, 26000), "covers 15 to 25"),
        ("", "not in the format"),
        ("20437", "not in the format"),
        (None, "sensor is not connected"),
    ],
)
def test_doubts_one_wire_readings(
    tmp_path: Path, w1: Path, content: str | None, words: str
) -> None:
    registered(tmp_path, "T-1", file_source(w1))
    if content is None:
        w1.unlink()
    else:
        w1.write_text(content)
    with pytest.raises(InputError, match=words):
        read_temperature(None, "T-1", NOW, tmp_path)


@pytest.mark.parametrize("content", ["nan", "inf", "-", "20,4", "", "85.0e3x"])
def test_doubts_numbers_of_hwmon_and_iio(tmp_path: Path, content: str) -> None:
    path = tmp_path / "temp1_input"
    path.write_text("20400\n")
    registered(tmp_path, "T-1", file_source(path))
    read = read_temperature(None, "T-1", NOW, tmp_path)
    assert read is not None
    assert read.celsius == pytest.approx(20.4)
    (tmp_path / "temp1_fault").write_text("1\n")
    with pytest.raises(InputError, match="temp1_fault reports a fault"):
        read_temperature(None, "T-1", NOW, tmp_path)
    (tmp_path / "temp1_fault").write_text("0\n")
    path.write_text(content)
    with pytest.raises(InputError, match="is not a number"):
        read_temperature(None, "T-1", NOW, tmp_path)


def test_tells_that_two_thermometers_disagree(tmp_path: Path) -> None:
    for name, milli in (("T-1", 20400), ("T-2", 20650), ("T-3", 20700)):
        (tmp_path / name).write_text(str(milli))
        registered(tmp_path, name, file_source(tmp_path / name))
    # U = 0.2 K each: 0.28 K may lie between two of them.
    read = read_temperature(None, "T-1,T-2", NOW, tmp_path)
    assert read is not None
    assert read.celsius == pytest.approx(20.4)
    with pytest.raises(InputError, match=r"T-1.*20.40.*T-3.*20.70.*differ by more"):
        read_temperature(None, "T-1, T-2, T-3", NOW, tmp_path)
    states = thermometer_log("T-1,T-3", NOW, tmp_path).sample()
    assert all("differ" in one.doubt and not one.note for one in states)


def logged(numbers: list[tuple[float, float]], **changes: object) -> list[str]:
    """Return the reservations about a log of (second, degrees)."""
    source = file_source(Path("/x"), scale=1.0, **changes)
    rest = iter(numbers)

    def read(_source: TemperatureSource) -> tuple[float, datetime]:
        second, value = next(rest)
        return value, NOW + timedelta(seconds=second)

    log = ThermometerLog([("T", "T", 0.1, source)], read)
    return [
        log.sample(lambda at=at: NOW + timedelta(seconds=at))[0].doubt  # type: ignore[misc] # mypy cannot infer it
        for at, _value in numbers
    ]


def test_doubts_stuck_jumping_and_stale_readings() -> None:
    honest = [(60.0 * k, 20.0 + 0.01 * (k % 3)) for k in range(600)]
    assert set(logged(honest)) == {""}
    stuck = logged([(60.0 * k, 20.0625) for k in range(300)])
    assert set(stuck[:240]) == {""}
    assert "to the last digit" in stuck[240]
    jump = [(10.0 * k, 20.0 if k < 5 else 22.5) for k in range(20)]
    doubts = logged(jump)
    assert "jumped by +2.50 K" in doubts[5]
    # After three equal readings in a row the new level counts.
    assert [bool(one) for one in doubts[4:10]] == [False, True, True, True, False, False]
    source = file_source(Path("/x"), oldest_s=30.0)
    log = ThermometerLog([("T", "T", 0.1, source)], lambda _one: (20000.0, NOW))
    assert not log.sample(lambda: NOW + timedelta(seconds=29))[0].doubt
    assert "31 s old" in log.sample(lambda: NOW + timedelta(seconds=31))[0].doubt
    assert "s old" in log.sample(lambda: NOW - timedelta(seconds=60))[0].doubt
    assert value_doubt(float("nan"))
    assert not value_doubt(49.9)
    assert not history_doubt(source, 0.1, [TemperatureSample(20.0, NOW)])


def reading_at(memory: Path, hour: float, value: float, key: str = "T") -> str:
    """Return the reservation about the only reading of a new program."""
    at = NOW + timedelta(hours=hour)
    source = file_source(Path("/x"), scale=1.0)
    log = ThermometerLog([(key, key, 0.1, source)], lambda _one: (value, at), memory)
    return log.sample(lambda: at)[0].doubt


def test_single_readings_reveal_a_repeated_old_value(tmp_path: Path) -> None:
    memory = tmp_path / "thermometers.json"
    doubts = [reading_at(memory, hour, 20.437) for hour in (0.0, 1.0, 2.0, 3.0, 4.0)]
    assert doubts[:4] == [""] * 4
    assert f"since {NOW:%Y-%m-%d %H:%M} UTC" in doubts[4]
    # Another thermometer is separate, and a value that changes again counts at once.
    assert not reading_at(memory, 4.1, 20.437, "other")
    assert "to the last digit" in reading_at(memory, 4.2, 20.437)
    assert not reading_at(memory, 4.3, 20.438)
    assert not reading_at(memory, 4.4, 20.437)


def test_few_equal_readings_prove_nothing(tmp_path: Path) -> None:
    memory = tmp_path / "thermometers.json"
    # One every evening: three are equal by chance where a sensor has steps of 0.1 K; and readings
    # within half an hour count once.
    for day in range(3):
        for minute in range(5):
            assert not reading_at(memory, 24.0 * day + minute / 60.0, 20.4)
    # A clock that was set back starts again.
    assert not reading_at(memory, -100.0, 20.4)


@pytest.mark.parametrize(
    "content", ["", "[", "[" * 10_000, '{"T":[{"celsius":20.4,"utc":"2026-01-01T00:00:00"}]}', "\0"]
)
def test_damaged_memory_refuses_no_reading(tmp_path: Path, content: str) -> None:
    memory = tmp_path / "thermometers.json"
    memory.write_text(content)
    assert not reading_at(memory, 0.0, 20.4)
    assert json.loads(memory.read_text())["T"]


def test_remembers_single_readings_of_the_register(tmp_path: Path, w1: Path) -> None:
    registered(tmp_path, "T-1", file_source(w1, stuck_s=10.0))
    since = NOW - timedelta(seconds=60.0)
    old = [{"celsius": 20.437, "utc": (since + timedelta(seconds=k)).isoformat()} for k in range(3)]
    (tmp_path / "thermometers.json").write_text(json.dumps({"T-1": old}))
    with pytest.raises(InputError, match=r"has been 20\.437 °C to the last digit"):
        read_temperature(None, "T-1", NOW, tmp_path)
    w1.write_text(W1.format(16, "YES", 16, 20438))
    assert read_temperature(None, "T-1", NOW, tmp_path) is not None


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"scale": 0.0}, "reads.scale"),
        ({"scale": float("nan")}, "reads.scale"),
        ({"register": 3}, "reads.register"),
        ({"topic": "a"}, "reads.topic"),
        ({"kind": "serial"}, "reads.place"),
        ({"kind": "serial", "place": "0"}, "reads.place"),
        ({"kind": "modbus", "form": "int16"}, "reads.register"),
        ({"kind": "modbus", "register": 70000, "form": "int16"}, "reads.register"),
        ({"kind": "modbus", "register": 1}, "reads.form"),
        ({"kind": "mqtt", "topic": "rooms/#"}, "reads.topic"),
        ({"address": " "}, "reads.address"),
        ({"oldest_s": 0.0}, "reads.oldest_s"),
    ],
)
def test_refuses_incomplete_sources(fields: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        file_source(Path("/x"), **fields).check("t.toml")


# Serial: a pseudo terminal is a line of the kernel.


@contextlib.contextmanager
def serial_line(line: bytes, *, query: bool = False) -> Iterator[str]:
    """Simulate a device on a pseudo terminal: it answers each query, or sends lines unasked."""
    device, name = pty.openpty()
    stop = threading.Event()

    def run() -> None:
        with contextlib.suppress(OSError):
            while not stop.wait(0.0 if query else 0.05):
                if query and not os.read(device, 64).endswith(b"?\n"):
                    continue
                os.write(device, line)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield os.ttyname(name)
    finally:
        stop.set()
        os.close(name)
        thread.join()
        os.close(device)


def serial_source(address: str, **changes: object) -> TemperatureSource:
    return file_source(Path(address), **{"kind": "serial", "scale": 1.0, "place": "2", **changes})


def test_reads_a_serial_thermometer() -> None:
    needs_package("serial", "extra `sensors`")
    with serial_line(b"CH1=1, T=20.43 C\r\n") as name:
        assert read_source(serial_source(name))[0] == 20.43
        with pytest.raises(InputError, match="has no number 3"):
            read_source(serial_source(name, place="3"))
    with serial_line(b"+2.0431E+01C\r\n", query=True) as name:
        source = serial_source(name, place="1", query="MEAS:TEMP?\\n")
        assert read_source(source)[0] == 20.431
    with serial_line(b"20,43\r\n") as name, pytest.raises(InputError, match="comma is decimal"):
        read_source(serial_source(name, place="1"))
    with serial_line(b"20.43;1013\r\n", query=True) as name:
        assert read_source(serial_source(name, place="1", query="?\\n"))[0] == 20.43
    with pytest.raises(InputError, match="serial /dev/none"):
        read_source(serial_source("/dev/none"))


def test_reads_modbus_registers() -> None:
    needs_package("pymodbus", "extra `sensors`")
    from pymodbus.datastore import (
        ModbusDeviceContext,
        ModbusSequentialDataBlock,
        ModbusServerContext,
    )
    from pymodbus.server import ModbusTcpServer

    port = free_port()
    # The block counts from 1: register 0 of the wire is address 1.
    block = ModbusSequentialDataBlock(1, [204, 65526, 0x41A3, 0x3333, 0x7FC0, 0])  # type: ignore[no-untyped-call] # pymodbus types it in part
    context = ModbusServerContext(devices=ModbusDeviceContext(ir=block, hr=block), single=True)

    async def serve() -> None:
        server = ModbusTcpServer(context, address=("127.0.0.1", port))
        await server.serve_forever(background=True)
        ready.set()
        await asyncio.to_thread(stop.wait)
        await server.shutdown()  # type: ignore[no-untyped-call] # as above

    ready, stop = threading.Event(), threading.Event()
    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert ready.wait(20.0)

        def number(register: int, form: str, **changes: object) -> float:
            return read_source(
                file_source(
                    Path("x"), kind="modbus", address=f"127.0.0.1:{port}", register=register,
                    form=form, **changes,
                )
            )[0]  # fmt: skip

        assert number(0, "int16") == 204.0
        assert number(0, "uint16", table="holding") == 204.0
        assert number(1, "int16") == -10.0
        assert number(2, "float32") == pytest.approx(20.4)
        assert number(4, "float32") != number(4, "float32")
        with pytest.raises(InputError, match="refuses register 60"):
            number(60, "int16")
    finally:
        stop.set()
        thread.join()
    with pytest.raises(InputError, match="no Modbus server answers"):
        number(0, "int16")


@contextlib.contextmanager
def mqtt_broker(**plugins: object) -> Iterator[int]:
    """Run a broker with plugins of `amqtt`, and yield its port."""
    needs_package("paho", "extra `sensors`")
    needs_package("amqtt", "a broker, of the development group")
    from amqtt.broker import Broker  # type: ignore[import-untyped] # it has no types

    port = free_port()
    ready, stop = threading.Event(), threading.Event()

    async def serve() -> None:
        broker = Broker(
            {
                "listeners": {"default": {"type": "tcp", "bind": f"127.0.0.1:{port}"}},
                "plugins": {f"amqtt.plugins.authentication.{k}": v for k, v in plugins.items()},
            }
        )
        await broker.start()
        ready.set()
        await asyncio.to_thread(stop.wait)
        await broker.shutdown()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert ready.wait(20.0)
        yield port
    finally:
        stop.set()
        thread.join()
        # The broker leaves its connection to the garbage collector: collect it here, not in a later
        # test.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            gc.collect()


def mqtt_number(port: int, topic: str, place: str = "", **changes: object) -> float:
    return read_source(
        file_source(
            Path("x"), kind="mqtt", address=f"127.0.0.1:{port}", topic=topic, place=place,
            **{"scale": 1.0, **changes},
        )
    )[0]  # fmt: skip


@contextlib.contextmanager
def mqtt_sensor(port: int, login: tuple[str, str] | None = None) -> Iterator[None]:
    """Send a temperature twenty times a second, and one that the broker keeps."""
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    sensor = Client(CallbackAPIVersion.VERSION2)
    if login is not None:
        sensor.username_pw_set(*login)
    quiet = threading.Event()

    def send() -> None:
        while not quiet.wait(0.05):
            sensor.publish("hall/t", json.dumps({"room": {"air": 20.4}, "ok": True}))
            sensor.publish("hall/plain", "293.55")

    sender = threading.Thread(target=send)
    try:
        sensor.connect("127.0.0.1", port)
        sensor.loop_start()
        sensor.publish("hall/kept", "20.4", qos=1, retain=True).wait_for_publish(10.0)
        sender.start()
        yield
    finally:
        quiet.set()
        sender.join()
        sensor.disconnect()
        sensor.loop_stop()


def test_reads_mqtt_messages_and_no_retained_ones() -> None:
    with mqtt_broker(AnonymousAuthPlugin={}) as port, mqtt_sensor(port):
        assert mqtt_number(port, "hall/t", "room.air") == 20.4
        assert mqtt_number(port, "hall/plain") == 293.55
        for place in ("room.wall", "ok", "room"):
            with pytest.raises(InputError, match="has no number"):
                mqtt_number(port, "hall/t", place)
        with pytest.raises(InputError, match="retained message, whose time is unknown"):
            mqtt_number(port, "hall/kept", oldest_s=0.5)
        with pytest.raises(InputError, match="no message came"):
            mqtt_number(port, "hall/other", oldest_s=0.5)
    with pytest.raises(InputError, match=r"mqtt 127\.0\.0\.1"):
        mqtt_number(port, "hall/t")


def test_broker_password_comes_from_the_environment_or_a_private_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_package("amqtt", "a broker, of the development group")
    from pwdlib.hashers.argon2 import Argon2Hasher

    users, held = tmp_path / "users", tmp_path / "login"
    users.write_text(f"ocmm:{Argon2Hasher().hash('se:cret')}\n")
    held.write_text("ocmm:se:cret\n")
    held.chmod(0o600)
    monkeypatch.setenv("HALL_LOGIN", "ocmm:se:cret")
    with (
        mqtt_broker(FileAuthPlugin={"password_file": str(users)}) as port,
        mqtt_sensor(port, ("ocmm", "se:cret")),
    ):
        assert mqtt_number(port, "hall/plain", login="HALL_LOGIN") == 293.55
        assert mqtt_number(port, "hall/plain", login=str(held)) == 293.55
        with pytest.raises(InputError, match="UNSET_LOGIN holds no user:password"):
            mqtt_number(port, "hall/plain", login="UNSET_LOGIN")
        held.chmod(0o644)
        with pytest.raises(InputError, match="others can read the password"):
            mqtt_number(port, "hall/plain", login=str(held))
    with pytest.raises(InputError, match=r"reads\.login.*not shown") as refused:
        file_source(Path("x"), kind="mqtt", topic="t", login="ocmm:se:cret").check("t.toml")
    assert "se:cret" not in f"{refused.value}"


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def test_stops_waiting_for_a_silent_server() -> None:
    """A server that accepts and then stays silent also ends the reading."""
    needs_package("pymodbus", "extra `sensors`")
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        source = file_source(
            Path("x"), kind="modbus", address=f"127.0.0.1:{deaf.getsockname()[1]}", register=0,
            form="int16",
        )  # fmt: skip
        begin = time.thread_time()
        with pytest.raises(InputError, match=r"modbus 127\.0\.0\.1"):
            read_source(source)
        assert time.thread_time() - begin < 2.0
