"""Operations of a host on a camera, against the objects of the software camera."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ocmm_core.camera import ideal_from_pixels, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import (
    BLOB_BYTES,
    CALIBRATION,
    CONFIGURATION,
    NEWEST_LAYOUT,
    SNAPSHOT,
    BlackImage,
    ErrorCode,
    Intrinsics,
    configuration_values,
)
from ocmm_core.fieldbus.device import _camera_slave as model
from ocmm_core.fieldbus.objects import _camera_client as client
from ocmm_sim.slave import SENSOR_PX, CameraStore, SimpleSensor, TestPattern
from ocmm_sim.slave import registers as reg
from tests.core.fieldbus import camera_statements as statements
from tests.core.fieldbus.direct_camera import SERIAL, DirectCamera

DATE_S = 1_790_000_000


def intrinsics() -> Intrinsics:
    camera = load_rig(resource("rigs", "thesis.toml")).cameras[0]
    return replace(Intrinsics.from_camera(camera, DATE_S), serial=SERIAL)


class SensorPattern(TestPattern, SimpleSensor):
    """The test pattern with a sensor that records its settings."""

    def __init__(self, *, broken: bool = False) -> None:
        SimpleSensor.__init__(self, self)
        self.settings: dict[str, object] = {}
        self.black: NDArray[np.uint16] | None = None
        self.broken = broken

    def configure(self, camera: int, config: model.CameraConfig) -> None:
        if any(left + width > SENSOR_PX for left, _top, width, _height in config.windows):
            raise InputError("test.window", "The window is not on the sensor.", "Move it.")
        self.settings = {
            "exposure_ns": config.exposure_ns, "threshold": config.threshold,
            "strobe": config.strobe, "windows": config.windows,
        }  # fmt: skip

    def black_image(self, camera: int, frames: int) -> NDArray[np.uint16]:
        if self.broken:
            raise BusError("test.sensor", "The sensor is broken.", "Repair it.")
        return super().black_image(camera, frames)

    def set_black_image(self, camera: int, image: NDArray[np.uint16] | None) -> None:
        self.black = image


def test_the_camera_tells_what_it_is() -> None:
    host = DirectCamera()
    texts = statements.read_identity_text(host)
    assert (texts.name, texts.serial) == (model.DEVICE_NAME, SERIAL)
    assert (texts.width, texts.height) == (SENSOR_PX, SENSOR_PX)
    assert statements.read_firmware(host) == texts.firmware == "3.0.0"
    assert statements.read_temperature(host) == 36.5
    host.camera.electronics.warmer_c = -60.05
    assert statements.read_temperature(host) == pytest.approx(-23.55, abs=0.051)
    assert statements.read_counters(host).emergencies == 0


def test_intrinsics_survive_the_camera_and_a_loss_of_power(tmp_path: Path) -> None:
    host = DirectCamera(store=CameraStore(tmp_path / "flash"))
    assert client.read_intrinsics(host) is None
    client.write_intrinsics(host, intrinsics(), "Certificate 17, 20 °C")
    again = DirectCamera(store=CameraStore(tmp_path / "flash"))
    assert client.read_intrinsics(again) == intrinsics()
    assert again.read(CALIBRATION, 5).decode() == "Certificate 17, 20 °C"
    assert again.read(CALIBRATION, 3) == hashlib.sha256(intrinsics().encode()).digest()


def test_flash_that_lost_a_bit_is_told_and_not_used(tmp_path: Path) -> None:
    host = DirectCamera(store=CameraStore(tmp_path))
    client.write_intrinsics(host, intrinsics(), "Certificate 17")
    client.measure_black_image(host, 2)
    client.store_black_image(host)
    for file in tmp_path.iterdir():
        content = bytearray(file.read_bytes())
        content[-1] ^= 1
        file.write_bytes(content)
    again = DirectCamera(store=CameraStore(tmp_path))
    assert client.read_intrinsics(again) is None
    assert again.read(CALIBRATION, 5) == b""
    assert client.read_black_image(again).images == BlackImage(0)
    codes = {message.code for message in client.read_error_history(again)}
    assert codes == {ErrorCode.STORED_DATA}


def test_intrinsics_of_another_camera_are_refused() -> None:
    host = DirectCamera()
    with pytest.raises(BusError, match="0x06090030"):
        client.write_intrinsics(host, replace(intrinsics(), serial=SERIAL + 1))
    assert client.read_intrinsics(host) is None
    with pytest.raises(InputError, match="1201 bytes"):
        client.write_intrinsics(host, intrinsics(), "x" * 1201)


def test_a_camera_that_keeps_something_else_is_found_out() -> None:
    host = DirectCamera()
    other = replace(intrinsics(), focal=intrinsics().focal + 1e-9).encode()
    host.camera.coe._values._live[CALIBRATION, 1] = lambda: other  # type: ignore[index]  # noqa: SLF001  # a defect
    with pytest.raises(BusError, match="did not retain") as caught:
        client.write_intrinsics(host, intrinsics())
    assert caught.value.code == "bus.intrinsics"
    with pytest.raises(BusError, match="did not retain"):
        client.read_intrinsics(host)


def test_a_damaged_block_of_intrinsics_is_never_used() -> None:
    block = intrinsics().encode()
    assert len(block) == BLOB_BYTES
    for at in range(len(block)):
        damaged = bytearray(block)
        damaged[at] ^= 0x10
        with pytest.raises(BusError, match="intrinsics"):
            Intrinsics.decode(bytes(damaged))
    with pytest.raises(BusError, match="bytes"):
        Intrinsics.decode(block[:-1])
    with pytest.raises(BusError, match="finite"):
        replace(intrinsics(), k1=float("nan")).encode()
    with pytest.raises(BusError, match="out of range"):
        replace(intrinsics(), width=70_000).encode()


def test_corrected_mode_sends_ideal_image_points() -> None:
    host = DirectCamera()
    client.write_intrinsics(host, intrinsics())
    config = model.CameraConfig(mode=model.CameraMode.CORRECTED)
    for index, sub, value in configuration_values(config):
        host.write(index, sub, value)
    host.go(reg.OP)
    for _ in range(3):
        content = host.cycle()
    found = np.frombuffer(content, model.INPUT_DTYPE)[0]
    header, n = found["header"], int(found["header"]["frames_valid"])
    assert header["config_crc"] == config.crc()
    assert n > 0
    _valid, _flags, uv = TestPattern().camera_frames(0, int(header["counter"]), n)
    expected = ideal_from_pixels(intrinsics().model(), uv)
    spots = model.decode_spots(found["frames"][:n], config.mode)
    # Half a step of the wire, 2^-25 mm, and what Newton's three steps leave.
    np.testing.assert_allclose(spots, expected, rtol=0.0, atol=3.1e-8)


def test_the_sensor_gets_the_configuration() -> None:
    pattern = SensorPattern()
    host = DirectCamera(pattern)
    config = model.CameraConfig(
        exposure_ns=33_000, threshold=77, strobe=5, windows=((0, 0, 0, 0), (1, 2, 3, 4))
    )
    for index, sub, value in configuration_values(config):
        host.write(index, sub, value)
    host.go(reg.SAFEOP)
    assert pattern.settings == {
        "exposure_ns": 33_000, "threshold": 77, "strobe": 5, "windows": config.windows,
    }  # fmt: skip
    host.go(reg.PREOP)
    host.write(0x8001, 5, (SENSOR_PX - 1).to_bytes(2, "little"))
    host.go(reg.SAFEOP)
    assert host.status == (reg.PREOP | reg.ERROR, 0x0026)


def test_a_black_image_is_measured_stored_cleared_and_survives(tmp_path: Path) -> None:
    pattern, store = SensorPattern(), CameraStore(tmp_path)
    host = DirectCamera(pattern, store)
    seen: list[tuple[int, int]] = []
    state = client.measure_black_image(host, 100, lambda done, all_: seen.append((done, all_)))
    assert state.images == BlackImage.IN_USE
    assert 120.0 < state.mean < 126.0
    assert pattern.black is not None
    assert state.sha256 == hashlib.sha256(pattern.black.astype("<u2").tobytes()).hexdigest()
    stored = client.store_black_image(host)
    assert stored.images == BlackImage.IN_USE | BlackImage.STORED | BlackImage.SAME

    fresh = SensorPattern()
    again = DirectCamera(fresh, CameraStore(tmp_path))
    assert client.read_black_image(again).sha256 == state.sha256
    assert fresh.black is not None
    np.testing.assert_array_equal(fresh.black, pattern.black)
    assert client.load_black_image(again).images == stored.images
    assert client.clear_black_image(again).images == BlackImage(0)
    assert fresh.black is None
    assert client.read_black_image(DirectCamera(store=CameraStore(tmp_path))).images == 0


def test_no_spot_is_valid_while_the_leds_are_off() -> None:
    host = DirectCamera(SensorPattern(), state=reg.OP)
    for _ in range(20):
        header = NEWEST_LAYOUT.decode(host.cycle(1, 0))
        host.cycle(1, header.counter + header.frames_valid - 1)
    host.write(0x8020, 2, b"\x40\x00")
    host.write(0x8020, 1, b"\x01")
    with pytest.raises(BusError, match="0x08000021"):
        host.write(0x8020, 1, b"\x01")
    dark, light = 0, 0
    while host.read(0x8020, 3) == b"\x01":
        content = host.cycle(1, header.counter + header.frames_valid - 1)
        header = NEWEST_LAYOUT.decode(content)
        frames = np.frombuffer(content, model.INPUT_DTYPE)[0]["frames"][: header.frames_valid]
        dark += int((frames["valid"] == 0).sum())
        light += int((frames["valid"] != 0).sum())
        if (frames["valid"] == 0).any():
            assert header.status & model.CameraStatus.DARK
    assert dark > 0
    for _ in range(40):
        header = NEWEST_LAYOUT.decode(host.cycle(1, header.counter + header.frames_valid - 1))
    assert not header.status & model.CameraStatus.DARK


def test_a_sensor_that_fails_is_reported() -> None:
    host = DirectCamera(SensorPattern(broken=True))
    with pytest.raises(BusError, match="reports a failure") as caught:
        client.measure_black_image(host, 10)
    assert caught.value.code == "bus.black_image"
    (message,) = client.read_error_history(host)
    assert message.code == ErrorCode.SENSOR
    with pytest.raises(InputError):
        client.measure_black_image(host, 0)


def test_the_error_history_comes_in_order_and_can_be_cleared() -> None:
    host = DirectCamera()
    assert client.read_error_history(host) == ()
    for code in range(0x1000, 0x1014):
        host.camera.emergency(code, 0x81, bytes([code & 0xFF]))
        host.work()
    history = client.read_error_history(host)
    assert [message.code for message in history] == list(range(0x1004, 0x1014))
    assert all(before.time_ns < after.time_ns for before, after in pairwise(history))
    assert history[0].data == b"\x04\x00\x00\x00\x00"
    client.clear_error_history(host)
    assert client.read_error_history(host) == ()


@pytest.mark.parametrize("region", [(100, 200, 64, 48), (2047, 0, 1, 2048), (0, 0, 300, 7)])
def test_a_snapshot_arrives_as_the_sensor_sees_it(region: tuple[int, int, int, int]) -> None:
    pattern = SensorPattern()
    seen: list[tuple[int, int]] = []
    picture = client.take_snapshot(
        DirectCamera(pattern), region, lambda done, total: seen.append((done, total))
    )
    np.testing.assert_array_equal(picture, pattern.image(0, *region))
    assert seen[-1] == (2 * region[2] * region[3],) * 2


def test_a_snapshot_of_the_whole_sensor_never_stalls_the_camera() -> None:
    """The picture grows slice by slice: no single step of the loop makes more than a slice."""
    host = DirectCamera()
    host.write(SNAPSHOT, 5, b"\x01")
    value, slices = host.camera.coe.value, 0
    while value(SNAPSHOT, 6) == b"\x01":
        before = value(SNAPSHOT, 7)[0]
        host.camera.generate(host.esc.now_ns)
        slices += 1
        assert value(SNAPSHOT, 7)[0] - before <= 1
    assert slices > 200
    assert host.read(SNAPSHOT, 8) == (2 * SENSOR_PX * SENSOR_PX).to_bytes(4, "little")
    host.write(SNAPSHOT, 9, (2 * SENSOR_PX * SENSOR_PX - 10).to_bytes(4, "little"))
    assert len(host.read(SNAPSHOT, 10)) == 10
    host.write(SNAPSHOT, 5, b"\x02")
    assert host.read(SNAPSHOT, 8) == bytes(4)


def test_a_cancelled_snapshot_leaves_nothing_in_the_camera() -> None:
    host = DirectCamera()

    def cancel(done: int, _total: int) -> None:
        if done > 8000:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        client.take_snapshot(host, (0, 0, 128, 128), cancel)
    assert host.read(SNAPSHOT, 6) == b"\x00"
    with pytest.raises(BusError, match="0x06090030"):
        client.take_snapshot(host, (2000, 0, 100, 10))


def test_a_garbled_snapshot_is_not_shown() -> None:
    host = DirectCamera()
    live = host.camera.coe._values._live  # noqa: SLF001  # a defect of the camera
    chunk = live[SNAPSHOT, 10]
    live[SNAPSHOT, 10] = lambda: chunk()[:-1] + bytes([chunk()[-1] ^ 1])  # type: ignore[index]  # as above
    with pytest.raises(BusError, match="checksum") as caught:
        client.take_snapshot(host, (0, 0, 32, 32))
    assert caught.value.code == "bus.snapshot"


def test_a_snapshot_that_no_sensor_makes_is_not_fetched() -> None:
    host = DirectCamera()
    live = host.camera.coe._values._live  # noqa: SLF001  # a defect of the camera
    sizes = {12: b"\xff\x7f", 13: b"\xff\xff", 8: (2 * 32767 * 65535).to_bytes(4, "little")}
    for sub, value in sizes.items():
        live[SNAPSHOT, sub] = lambda value=value: value  # type: ignore[index]  # as above
    del live[SNAPSHOT, 10]  # type: ignore[attr-defined]  # as above: who fetches a part, fails here
    with pytest.raises(BusError, match="32767 x 65535 pixels"):
        client.take_snapshot(host)


def test_entries_of_the_wrong_size_are_not_guessed_at() -> None:
    host = DirectCamera()
    live = host.camera.coe._values._live  # noqa: SLF001  # a defect of the camera
    live[0x9000, 4] = lambda: b"\x01"  # type: ignore[index]  # as above
    with pytest.raises(BusError, match="1 bytes instead of 2"):
        statements.read_temperature(host)
    host.write(CONFIGURATION, 3, b"\x01\x00")
