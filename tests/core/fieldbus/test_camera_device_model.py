"""The device model: one table, and everything that is made from it agrees."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest

from ocmm_core.acquisition.frames import SUBPIXEL, FrameFlag, quantise
from ocmm_core.camera import MAX_CAMERAS, USUAL_SLOTS
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import (
    DATA_CRC_AT,
    INPUT_LAYOUTS,
    NEWEST_LAYOUT,
    NO_MARK,
    Header,
    InputLayout,
    data_mark,
    object_dictionary,
)
from ocmm_core.fieldbus.device import _camera_slave as model
from ocmm_core.fieldbus.wire._object_calls import check_room
from ocmm_sim.slave import OVERRUN_FLAG, SoftwareCamera, TestPattern, sii


def bits(pdos: tuple[model.Pdo, ...]) -> int:
    return sum(entry.bits for pdo in pdos for entry in pdo.entries)


def test_structures_have_the_sizes_of_the_mapping() -> None:
    assert model.INPUT_DTYPE.itemsize * 8 == bits(model.INPUT_PDOS)
    assert model.OUTPUT_DTYPE.itemsize * 8 == bits((model.OUTPUT_PDO,))
    assert model.FRAME_DTYPE.itemsize * 8 == bits((model.FRAME_PDOS[0],))
    assert model.HEADER_STRUCT.size == model.HEADER_DTYPE.itemsize
    assert model.OUTPUT_STRUCT.size == model.OUTPUT_DTYPE.itemsize


def test_wire_and_core_mean_the_same() -> None:
    assert model.N_SLOTS == USUAL_SLOTS
    assert 1.0 / model.SUBPIXELS == SUBPIXEL
    assert OVERRUN_FLAG == FrameFlag.OVERRUN


def test_one_bus_takes_four_cameras_and_says_so_of_more() -> None:
    check_room(4)
    for count in (5, MAX_CAMERAS):
        with pytest.raises(BusError, match=f"There are {count} cameras") as caught:
            check_room(count)
        assert caught.value.remedy == "Connect at most 4 cameras to the bus."
    # One camera must fit into one Ethernet frame, or a cycle could mix two of its updates.
    assert model.INPUT_DTYPE.itemsize <= 1466


def test_header_survives_the_way_through_numpy_and_struct() -> None:
    for layout in INPUT_LAYOUTS.values():
        cycle = layout.cycle_counters - 1
        header = Header(4_000_000_000, 2**40, 125_000, 12, cycle, 7, 0xBEEF, 3, 0xDEADBEEF)
        content = layout.encode(header)
        assert layout.decode(content) == header
        decoded = np.frombuffer(content, model.plain_dtype(layout.header_pdo))[0]
        for entry in layout.header_pdo.entries:
            assert decoded[entry.name] == getattr(header, entry.name)


def test_spots_arrive_as_quantised() -> None:
    valid, flags, uv = TestPattern().camera_frames(1, 0, 400)
    frames = model.encode_frames(valid, flags, uv)
    np.testing.assert_array_equal(model.decode_spots(frames), quantise(uv))
    np.testing.assert_array_equal(frames["valid"], valid)
    np.testing.assert_array_equal(frames["flags"], flags)


def test_dictionary_describes_the_mapping_and_the_identity() -> None:
    objects = object_dictionary(4711)
    assert objects[0x1018].entries[4].value == struct.pack("<I", 4711)
    assigned = [
        struct.unpack("<H", objects[0x1C13].entries[sub].value)[0]
        for sub in range(1, objects[0x1C13].entries[0].value[0] + 1)
    ]
    assert assigned == [pdo.index for pdo in model.INPUT_PDOS]
    total = sum(
        struct.unpack("<I", entry.value)[0] & 0xFF
        for index in assigned
        for sub, entry in objects[index].entries.items()
        if sub
    )
    assert total == 8 * model.INPUT_DTYPE.itemsize


def test_sii_holds_identity_checksum_and_all_categories() -> None:
    image = sii.sii_image(serial=4711, alias=77)
    assert struct.unpack_from("<H", image, 8) == (77,)
    assert struct.unpack_from("<IIII", image, 16) == (
        model.VENDOR_ID,
        model.PRODUCT_CODE,
        model.REVISION,
        4711,
    )
    # CRC-8, polynomial 0x07, start 0xFF over the first 14 bytes: shifting the check byte itself
    # through the register leaves zero.
    crc = 0xFF
    for byte in image[:15]:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    assert crc == 0
    kinds, at = [], 0x80
    while (kind := struct.unpack_from("<H", image, at)[0]) != 0xFFFF:
        kinds.append(kind)
        at += 4 + 2 * struct.unpack_from("<H", image, at + 2)[0]
    assert kinds == [10, 30, 40, 41, *[50] * len(model.INPUT_PDOS), 51, 60]


def test_configuration_check_sum_depends_on_every_field() -> None:
    sums = {
        model.CameraConfig().crc(),
        model.CameraConfig(frame_period_ns=250_000).crc(),
        model.CameraConfig(exposure_ns=1).crc(),
        model.CameraConfig(threshold=1).crc(),
        model.CameraConfig(mode=model.CameraMode.CORRECTED).crc(),
        model.CameraConfig(strobe=1).crc(),
        model.CameraConfig(windows=((1, 0, 0, 0),)).crc(),
        model.CameraConfig(windows=((0, 0, 0, 0), (0, 0, 0, 1))).crc(),
    }
    assert len(sums) == 8


def test_configuration_refuses_what_cannot_be_sent() -> None:
    with pytest.raises(InputError, match="'threshold'"):
        model.CameraConfig(threshold=65536)
    with pytest.raises(InputError, match="'windows'"):
        model.CameraConfig(windows=((-1, 0, 0, 0),))
    with pytest.raises(InputError, match="9 windows"):
        model.CameraConfig(windows=((0, 0, 1, 1),) * 9)


def test_only_raw_coordinates_are_measured_with() -> None:
    model.require_raw(model.CameraConfig())
    with pytest.raises(BusError, match="raw"):
        model.require_raw(model.CameraConfig(mode=model.CameraMode.CORRECTED))


@pytest.mark.parametrize("layout", INPUT_LAYOUTS.values(), ids=lambda one: hex(one.revision))
def test_no_changed_bit_of_the_input_goes_unnoticed(layout: InputLayout) -> None:
    camera = SoftwareCamera(0, 1001, 1, TestPattern(), layout=layout)
    camera.refresh_inputs()
    size = model.INPUT_DTYPE.itemsize
    content = bytearray(camera.esc.memory[sii.INPUT_START : sii.INPUT_START + size])
    mark = layout.mark(1001)
    assert data_mark(bytes(content)) == mark
    for bit in range(8 * size):
        content[bit // 8] ^= 1 << bit % 8
        assert data_mark(bytes(content)) != mark, bit
        content[bit // 8] ^= 1 << bit % 8
    assert data_mark(bytes(content) + b"\0") == NO_MARK != mark


def test_the_check_sum_is_that_of_serial_number_and_input_one_after_the_other() -> None:
    camera = SoftwareCamera(0, 1001, 1, TestPattern())
    camera.refresh_inputs()
    size = model.INPUT_DTYPE.itemsize
    content = bytes(camera.esc.memory[sii.INPUT_START : sii.INPUT_START + size])
    at = DATA_CRC_AT
    plain = content[:at] + bytes(4) + content[at + 4 :]
    expected = zlib.crc32(plain, zlib.crc32((1001).to_bytes(4, "little")))
    assert expected.to_bytes(4, "little") == content[at : at + 4]
    assert NEWEST_LAYOUT.crc(content, 1001) == expected


def test_no_two_serial_numbers_have_one_mark() -> None:
    serials = [*range(1, 2000), *np.random.default_rng(3).integers(1, 1 << 32, 2000).tolist()]
    marks = {NEWEST_LAYOUT.mark(serial) for serial in serials}
    assert len(marks) == len(set(serials))
    assert 0 not in marks, "the mark of cameras that say no serial number"


def test_corrected_image_points_survive_the_wire() -> None:
    uv = np.linspace(-12.3, 12.3, 3 * 16).reshape(3, 8, 2)
    mode = model.CameraMode.CORRECTED
    frames = model.encode_frames(np.full(3, 0xFF, np.uint16), np.zeros(3, np.uint16), uv, mode)
    np.testing.assert_allclose(model.decode_spots(frames, mode), uv, rtol=0.0, atol=2.0**-25)
