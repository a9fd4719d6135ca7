"""Cameras that a file describes: the document, the bytes, back to pixels, their proofs."""

from __future__ import annotations

import struct
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.camera import CameraModel, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.cycle import CameraPast, CycleAnswer, Schedule, judge
from ocmm_core.fieldbus.cycle._watch import CameraView, WatchView
from ocmm_core.fieldbus.described import (
    Clock,
    DeviceDescription,
    InputTranslator,
    ProcessImage,
    Role,
    Sends,
    Timing,
    corrected_from_pixels,
    doubts_of,
    load_device,
    pixels_from_corrected,
    refuse_coarse,
    refuse_unproven,
    resting_doubt_mm,
)
from ocmm_core.fieldbus.device import (
    FRAME_DTYPE,
    HEADER_STRUCT,
    NEWEST_LAYOUT,
    CameraConfig,
    decode_spots,
)
from ocmm_core.fieldbus.report import Alarm
from ocmm_sim.slave import DescribedCamera, TestPattern

SERIAL = 20330001
START = 10**15
THESIS, PLAIN = load_device("thesis-camera"), load_device("plain-spots")
CRC = CameraConfig().crc()


def lens() -> CameraModel:
    return load_rig(resource("rigs", "thesis.toml")).cameras[0]


def thesis_bytes(camera: CameraModel, uv: np.ndarray) -> bytes:
    """Return the bytes by 2.4.1 of the thesis, written independently and in plain numbers."""
    content = b""
    for u, v in uv:
        if np.isnan(u):
            content += struct.pack("<ff", 0.0, 0.0)
            continue
        x, y = (u - camera.u0) / camera.sx, (v - camera.v0) / camera.sy
        r2 = x * x + y * y
        radial = camera.k1 * r2 + camera.k2 * r2 * r2
        dx = x * radial + 2 * camera.p1 * x * y + camera.p2 * (3 * x * x + y * y)
        dy = y * radial + camera.p1 * (x * x + 3 * y * y) + 2 * camera.p2 * x * y
        content += struct.pack("<ff", x - dx, y - dy)
    return content


def slave(device: DeviceDescription, index: int = 0) -> DescribedCamera:
    model = lens() if device.is_corrected else None
    return DescribedCamera(index, SERIAL, 21, TestPattern(), device, model)


def translator(device: DeviceDescription) -> InputTranslator:
    model = lens() if device.is_corrected else None
    return InputTranslator(
        device, ProcessImage(device), SERIAL, model, Timing(START, device.period_ns, CRC)
    )


class Bus:
    """A described camera that is read cycle by cycle, and judged as on the bus."""

    def __init__(self, device: DeviceDescription) -> None:
        self.device = device
        self.slave = slave(device)
        self.slave.start_ns, self.slave.period_ns = START, device.period_ns
        self.translator = translator(device)
        counts = device.has(Role.COUNTER)
        self.past = CameraPast("left", mark=NEWEST_LAYOUT.mark(SERIAL), counts=counts)
        self.fault = self.remedy = ""
        self.schedule = Schedule(START, device.period_ns, CRC)

    def cycle(self, block: int, content: bytes | None = None) -> tuple[str, bytes]:
        """Return the alarm, and the inputs, of the cycle in which ``block`` is the newest."""
        device = self.device
        clock = START + (block + 1) * device.cycle_ns + device.latency_ns + 100_000
        self.slave.renewals = block + 1
        raw = self.slave.inputs(block * device.exposures) if content is None else content
        inputs = self.translator.translate(raw, clock, self.past.next_frame)
        header = NEWEST_LAYOUT.decode(inputs)
        answer = CycleAnswer(
            True, 3, 3, clock, True, WatchView(0, 1, (CameraView(1, 8),)), (inputs,), (header,)
        )
        fault = judge(answer, [self.past], self.schedule)
        if fault is not None:
            self.fault, self.remedy = fault.reason, fault.remedy
        if fault is None:
            first = (header.start_ns - START) // device.period_ns
            self.past = self.past._replace(
                next_frame=max(self.past.next_frame, first + header.frames_valid),
                cycle_counter=header.cycle_counter,
                boot_counter=header.boot_counter,
            )
        return ("" if fault is None else fault.alarm), inputs


def spots(inputs: bytes, count: int) -> np.ndarray:
    frames = np.frombuffer(inputs, FRAME_DTYPE, count=count, offset=HEADER_STRUCT.size)
    return decode_spots(frames)


def test_the_bytes_of_the_thesis_camera_are_those_of_its_description() -> None:
    camera = slave(THESIS)
    camera.start_ns, camera.period_ns = START, THESIS.period_ns
    _valid, _flags, uv = TestPattern().camera_frames(0, 40, 1)
    assert camera.inputs(40) == thesis_bytes(lens(), uv[0])
    assert len(camera.inputs(40)) == 8 * 2 * 4


@pytest.mark.parametrize("sends", [Sends.ONE_STEP, Sends.EXACT])
def test_corrected_points_lead_back_to_the_pixels(sends: Sends) -> None:
    camera = lens()
    axis = np.linspace(0.0, 2047.0, 33)
    uv = np.stack(np.meshgrid(axis, axis), axis=-1)
    back = pixels_from_corrected(camera, corrected_from_pixels(camera, uv, sends), sends)
    # Rounding of numbers of some 12 mm, a few steps; 1e-9 px is a ten-thousandth of the wire's.
    np.testing.assert_allclose(back, uv, rtol=0, atol=1e-9)
    exact, one = (corrected_from_pixels(camera, uv, each) for each in (Sends.EXACT, Sends.ONE_STEP))
    # Error of the thesis's single step at the corner; taken as exact it would enter the results.
    assert np.abs(exact - one).max() / camera.pitch_mm > 0.02


@pytest.mark.parametrize("device", [THESIS, PLAIN], ids=["thesis", "plain"])
def test_what_the_sensor_saw_comes_out_in_pixels_at_its_exposure(device: DeviceDescription) -> None:
    bus = Bus(device)
    tolerance = max(device.lens_doubt_px, 0.5 * device.step if not device.is_corrected else 0.0)
    for block in range(30):
        alarm, inputs = bus.cycle(block)
        assert alarm == "", block
        first = block * device.exposures
        _valid, _flags, uv = TestPattern().camera_frames(0, first, device.exposures)
        uv = uv.copy()
        uv[:, device.slots :] = np.nan
        header = NEWEST_LAYOUT.decode(inputs)
        assert (header.counter, header.frames_valid) == (first, device.exposures)
        assert header.start_ns == START + first * device.period_ns
        np.testing.assert_allclose(
            spots(inputs, device.exposures), uv, rtol=0, atol=tolerance + 1e-5
        )


def test_a_counter_that_stands_still_or_contradicts_the_clock_is_refused() -> None:
    bus = Bus(PLAIN)
    for block in range(5):
        _alarm, _inputs = bus.cycle(block)
    old = bus.slave.inputs(4 * PLAIN.exposures)
    assert bus.cycle(5, old)[0] == Alarm.FROZEN
    assert bus.cycle(6)[0] == Alarm.PAYLOAD
    assert bus.cycle(7)[0] == ""
    # Its counter advanced by five in one cycle.
    bus.slave.renewals = 13
    skipped = bus.slave.inputs(8 * PLAIN.exposures)
    assert bus.cycle(8, skipped)[0] == Alarm.PAYLOAD


def test_without_a_counter_inputs_that_repeat_to_the_last_bit_are_old() -> None:
    bus = Bus(THESIS)
    for block in range(5):
        assert bus.cycle(block)[0] == ""
    old = bus.slave.inputs(4)
    alarms = [bus.cycle(block, old)[0] for block in range(5, 12)]
    assert "have no counter" in bus.fault
    assert "finer steps" in bus.remedy
    assert "Power-cycle" not in bus.remedy
    # Two might be alike by chance; from the third on it is certain.
    assert alarms[:2] == ["", ""]
    assert set(alarms[2:]) == {Alarm.FROZEN}
    # A camera that sees nothing sends the same all the time.
    dark = Bus(THESIS)
    nothing = bytes(ProcessImage(THESIS).input_bytes)
    assert {dark.cycle(block, nothing)[0] for block in range(12)} == {""}


def test_a_cycle_that_was_lost_is_a_gap_that_is_told() -> None:
    bus = Bus(THESIS)
    for block in (0, 1, 2, 5):
        alarm, inputs = bus.cycle(block)
        assert alarm == ""
    # Without the overrun bit the same gap would be refused: the camera did not report it.
    assert NEWEST_LAYOUT.decode(inputs).status & 4


def test_near_the_renewal_of_the_inputs_nothing_is_taken() -> None:
    device = THESIS
    reader = translator(device)
    content = slave(device)
    content.start_ns, content.period_ns = START, device.period_ns
    for into_ns, certain in ((2_000, False), (998_000, False), (100_000, True), (500_000, True)):
        inputs = reader.translate(content.inputs(7), START + 8 * device.cycle_ns + into_ns)
        assert bool(NEWEST_LAYOUT.decode(inputs).status & 2) is certain


@pytest.mark.parametrize(
    "values", [np.nan, np.inf, -np.inf, 3e38, 1e9, -2e6], ids=lambda value: f"{value:g}"
)
def test_nonsense_in_the_numbers_is_no_spot(values: float) -> None:
    content = struct.pack("<16f", *[values] * 16)
    valid, _flags, uv = translator(THESIS).spots(content)
    assert valid[0] == 0
    assert np.isnan(uv).all()


def test_what_a_camera_cannot_prove_is_said_and_costs_or_is_refused() -> None:
    thesis = {doubt.code for doubt in doubts_of(THESIS)}
    assert thesis == {
        "device.no_check_sum", "device.no_counter", "device.no_validity", "device.no_time",
        "device.corrected",
    }  # fmt: skip
    costs = {doubt.code: doubt.costs_mm for doubt in doubts_of(PLAIN)}
    # A ball that rests moves slower than 2 mm/s: half a millisecond is 1 µm.
    assert costs["device.arrival_time"] == pytest.approx(0.001)
    assert resting_doubt_mm(PLAIN) == costs["device.arrival_time"]
    assert resting_doubt_mm(THESIS) == 0.0
    for device, why in ((THESIS, "no counter.*no time of exposure"), (PLAIN, "no common clock")):
        refuse_unproven(device, allowed=True)
        with pytest.raises(InputError, match=why):
            refuse_unproven(device, allowed=False)


def changed(tmp_path: Path, name: str, old: str, new: str) -> Path:
    text = resource("devices", f"{name}.toml").read_text()
    assert old in text
    path = tmp_path / "device.toml"
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("thesis-camera", "slots = 8", "slots = 9", "'slots' is 9, but must be 1 to 8"),
        ("thesis-camera", "step = 1.0", "step = 0.0", "'step' is 0.0"),
        ("thesis-camera", "[0x00010000, 0x0001FFFF]", "[5, 4]", "'revisions' is 5"),
        ("thesis-camera", "slots = true", "slots = false", "but not for each slot"),
        ("thesis-camera", '["x", "y"]', '["x", "x"]', "mapped twice|numbers 'x'"),
        ("thesis-camera", 'role = ["heartbeat"]', 'role = ["x"]', "none of outputs"),
        ("thesis-camera", "index = 0x1A00", "index = 0x0A00", "0x0a00, which cannot be"),
        ("plain-spots", "doubt_ns = 500_000", "doubt_ns = 0", "known by arrival has a doubt"),
        ("plain-spots", "exposures = 4", "exposures = 3", "do not divide"),
        ("plain-spots", "exposures = 4", "exposures = 13", "'exposures' is 13"),
        ("plain-spots", "step = 0x10", "step = 0", "mapped twice"),
        ("plain-spots", 'type = "UINT", role = ["counter"]', 'type = "REAL32", role = ["counter"]',
         "whole number"),
        ("plain-spots", 'clock = "arrival"', 'clock = "sundial"', "sundial"),
        ("plain-spots", "vendor =", "seller =", "seller|vendor"),
        ("plain-spots", "value = 200 #", "value = 70_000 #", "whole number from 0 to 65535"),
        ("plain-spots", "value = 200 #", "value = 0.5 #", "whole number from 0 to 65535"),
        ("plain-spots", "value = 1 }", "value = -1 }", "value -1, but a UINT"),
        ("plain-spots", "step = 0x10", "step = -2048", "0x0210, which cannot be"),
        ("plain-spots", "sub = 2\ntype", "sub = 300\ntype", "0x8000:300"),
        ("plain-spots", 'sub = 3, type = "USINT", role = ["ignored"]',
         'sub = 3, type = "UDINT", role = ["time"]', "no time of the bus clock"),
        ("plain-spots", 'sub = 3, type = "USINT", role = ["ignored"]',
         'sub = 3, type = "USINT", role = ["counter"]', "more than one number 'counter'"),
        ("plain-spots", "index = 0x1600", "index = 0x1A20", "0x1a20 is there twice"),
        ("thesis-camera", "doubt_ns = 20", "doubt_ns = 500_000", "from half of that on"),
        ("thesis-camera", 'name = "Camera', 'name = "\\u001b[2JCamera', "cannot be printed"),
        ("thesis-camera", "slots = true }", 'slots = true }, '
         '{ index = 0x6001, sub = 1, type = "UINT", role = ["time"] }', "takes 32 at least"),
        ("thesis-camera", "doubt_ns = 20", "doubt_ns = 20\nmailbox = [0x1000, 8, 0x1100, 256]",
         "'mailbox' has 8 bytes"),
    ],
)  # fmt: skip
def test_a_description_that_contradicts_itself_is_refused_in_a_sentence(
    tmp_path: Path, name: str, old: str, new: str, words: str
) -> None:
    path = changed(tmp_path, name, old, new)
    with pytest.raises(InputError, match=words) as caught:
        load_device(str(path))
    assert str(path) in caught.value.what
    assert caught.value.remedy


def test_ten_thousand_entries_are_refused_in_a_sentence(tmp_path: Path) -> None:
    entries = ", ".join(
        f'{{ index = {0x2000 + n}, sub = 1, type = "USINT", role = ["ignored"] }}'
        for n in range(10_000)
    )
    old = "entries = [{ index = 0x7000"
    path = changed(tmp_path, "thesis-camera", old, old.replace("[", f"[{entries}, "))
    with pytest.raises(InputError, match="has 10001 entries"):
        load_device(str(path))
    objects = "".join(f"[[inputs]]\nindex = {0x1B00 + n}\nentries = []\n" for n in range(10_000))
    path = changed(tmp_path, "thesis-camera", "[[outputs]]", f"{objects}[[outputs]]")
    with pytest.raises(InputError, match="has 10001 process data objects"):
        load_device(str(path))


# Corrected millimetres in whole steps, two exposures a cycle, each with its number and its time.
ODD = """
schema = "ocmm.device/1"
unit = "mm"
name = "Odd"
vendor = 0xFA4E0003
product = 7
revisions = [1, 1]
sends = "corrected mm, exact"
step = 5e-7
slots = 5
exposures = 2
clock = "distributed"
doubt_ns = 1000
latency_ns = 30_000
[[inputs]]
index = 0x1A01
exposures = true
step = -1
entries = [
    { index = 0x6010, sub = 1, type = "USINT", role = ["counter"] },
    { index = 0x6020, sub = 1, type = "UDINT", role = ["time"] },
    { index = 0x6030, sub = 1, type = "ULINT", role = ["valid"] },
    { index = 0x6040, sub = 1, type = "DINT", role = ["x", "y"], slots = true },
    { index = 0x6050, sub = 1, type = "USINT", role = ["ignored"] },
]
[[outputs]]
index = 0x1600
entries = [{ index = 0x7000, sub = 1, type = "UDINT", role = ["heartbeat"] }]
"""
_OF_ONE = 1 + 4 + 8 + 5 * 8 + 1
"""Bytes of an exposure."""


@pytest.fixture(scope="module")
def odd(tmp_path_factory: pytest.TempPathFactory) -> DeviceDescription:
    path = tmp_path_factory.mktemp("odd") / "odd.toml"
    path.write_text(ODD)
    return load_device(str(path))


def test_numbers_and_times_of_each_exposure_are_compared(odd: DeviceDescription) -> None:
    # Neither age nor order is doubtful: a plan need not allow it, and all checks run.
    assert {one.code for one in doubts_of(odd)} == {"device.no_check_sum", "device.corrected"}
    bus = Bus(odd)
    # More cycles than its counter of 8 bits and its time of 32 bits have numbers for.
    for block in (*range(300), 5000, 5001):
        alarm, inputs = bus.cycle(block)
        assert alarm == "", block
    _valid, _flags, uv = TestPattern().camera_frames(0, 10002, 2)
    uv[:, odd.slots :] = np.nan
    # Half a step of 0.5 nm in mm, on pixels of 12 um, and that of the wire.
    np.testing.assert_allclose(spots(inputs, 2), uv, rtol=0, atol=2.5e-7 / 0.012 + 1e-5)
    for at, what in ((0, Alarm.PAYLOAD), (1, Alarm.PAYLOAD), (_OF_ONE, Alarm.PAYLOAD),
                     (_OF_ONE + 3, Alarm.PAYLOAD)):  # fmt: skip
        bus = Bus(odd)
        for block in range(5):
            assert bus.cycle(block)[0] == ""
        bus.slave.renewals = 6
        wrong = bytearray(bus.slave.inputs(10))
        wrong[at] ^= 0x20
        # A time that is off by 32 ns is within its uncertainty; the byte above it is not.
        found = bus.cycle(5, bytes(wrong))[0]
        assert found == ("" if at == 1 else what)
        assert bus.cycle(6)[0] == ("" if at else Alarm.PAYLOAD)


def test_a_camera_that_stands_still_is_old_whatever_else_it_changes(
    odd: DeviceDescription, tmp_path: Path
) -> None:
    bus = Bus(odd)
    for block in range(5):
        assert bus.cycle(block)[0] == ""
    old = bytearray(bus.slave.inputs(8))
    old[-1] ^= 1
    assert bus.cycle(5, bytes(old))[0] == Alarm.FROZEN
    path = changed(tmp_path, "thesis-camera", "slots = true }", 'slots = true }, '
                   '{ index = 0x6001, sub = 1, type = "USINT", role = ["ignored"] }')  # fmt: skip
    bus = Bus(load_device(str(path)))
    for block in range(5):
        assert bus.cycle(block)[0] == ""
    still = bus.slave.inputs(4)[:-1]
    alarms = [bus.cycle(5 + n, still + bytes([n]))[0] for n in range(6)]
    assert alarms[2:] == [Alarm.FROZEN] * 4


def test_every_bit_of_a_long_number_may_be_set(odd: DeviceDescription) -> None:
    content = bytearray(slave(odd).inputs(0))
    for at in (5, _OF_ONE + 5):
        content[at : at + 8] = b"\xff" * 8
    valid, _flags, _uv = translator(odd).spots(bytes(content))
    assert (valid <= 0b11111).all()
    assert valid.any()


def test_a_loose_clock_costs_and_is_told(tmp_path: Path) -> None:
    path = changed(tmp_path, "thesis-camera", "doubt_ns = 20", "doubt_ns = 250_000")
    device = load_device(str(path))
    assert "device.loose_clock" in {one.code for one in doubts_of(device)}
    assert resting_doubt_mm(device) == pytest.approx(0.0005)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("step = 1.0", "step = 1e-3", None),
        ('type = "REAL32"', 'type = "DINT"', "steps of 83.3 px"),
        ("lens_doubt_px = 1e-4", "lens_doubt_px = 0.1", "undone within 0.1 px"),
    ],
)
def test_numbers_that_are_coarser_than_the_noise_are_refused(
    tmp_path: Path, old: str, new: str, words: str | None
) -> None:
    device = load_device(str(changed(tmp_path, "thesis-camera", old, new)))
    noise = load_rig(resource("rigs", "recommended.toml")).noise
    pixels = {"white_px": noise.white_px, "pattern_px": noise.pattern_px, "pitch_mm": 0.012}
    refuse_coarse(THESIS, **pixels)
    refuse_coarse(PLAIN, **pixels)
    if words is None:
        refuse_coarse(device, **pixels)
        return
    with pytest.raises(InputError, match=words):
        refuse_coarse(device, **pixels)


def test_process_data_must_fit_into_the_memory_of_a_controller(tmp_path: Path) -> None:
    path = changed(
        tmp_path, "thesis-camera", "doubt_ns = 20", "doubt_ns = 20\nmemory = [0x1000, 0x1800]"
    )
    with pytest.raises(InputError, match="overlaps"):
        load_device(str(path))


def test_an_unknown_name_lists_those_that_are_shipped() -> None:
    with pytest.raises(InputError) as caught:
        load_device("nothing")
    assert "plain-spots, thesis-camera" in caught.value.remedy


def test_a_description_travels_to_the_bus_process_unchanged() -> None:
    for device in (THESIS, PLAIN):
        assert msgspec.json.decode(msgspec.json.encode(device), type=DeviceDescription) == device
    assert (THESIS.clock, PLAIN.clock) == (Clock.DISTRIBUTED, Clock.ARRIVAL)
    assert PLAIN.has(Role.INTENSITY)
