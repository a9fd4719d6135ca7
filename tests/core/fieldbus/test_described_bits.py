"""Entries of single bits and gaps: layout, decoding and refusals of device descriptions."""

from __future__ import annotations

import struct
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import (
    DeviceDescription,
    Entry,
    InputTranslator,
    ProcessImage,
    ProcessObject,
    Role,
    Timing,
    load_device,
)
from ocmm_core.fieldbus.device import FRAME_DTYPE, HEADER_STRUCT, decode_spots
from tests.bit_device import bit_device

PLAIN = load_device("plain-spots")
N_LAYOUTS = 300
_SIGNED = {"SINT": 8, "INT": 16, "DINT": 32, "LINT": 64}
_UNSIGNED = {"USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64, "BITS": 64}
_FLOATS = {"REAL32": ("<f", 32), "REAL64": ("<d", 64)}


def read_bits(content: bytes, at: int, count: int) -> str:
    """Return bits as text, highest first, one by one: an independent reader."""
    bits = "".join(format(byte, "08b")[::-1] for byte in content)
    return bits[at : at + count][::-1]


def meaning(bits: str, kind: str) -> float:
    """Return the number that these bits mean."""
    if kind in _FLOATS:
        form, width = _FLOATS[kind]
        return float(struct.unpack(form, int(bits, 2).to_bytes(width // 8, "little"))[0])
    if kind in _SIGNED and bits[0] == "1":
        return float(int(bits, 2) - (1 << len(bits)))
    return float(int(bits, 2))


def random_layout(rng: np.random.Generator) -> tuple[DeviceDescription, list[tuple[int, int, str]]]:
    """Return a description and the place, length and type of x and y of every slot."""
    slots = int(rng.integers(1, 9))
    kind = str(rng.choice([*_SIGNED, *_UNSIGNED, *_FLOATS]))
    width = _FLOATS[kind][1] if kind in _FLOATS else int(
        rng.integers(1, {**_SIGNED, **_UNSIGNED}[kind] + 1)
    )  # fmt: skip
    entries: list[Entry] = []
    places: list[tuple[int, int, str]] = []
    at, sub = 0, 1
    for slot in range(slots):
        for role in (Role.X, Role.Y):
            for _ in range(int(rng.integers(0, 3))):
                gap = int(rng.integers(1, 13))
                entries.append(Entry(index=0, sub=0, type="BITS", role=(Role.IGNORED,), bits=gap))
                at += gap
            bits = 0 if kind in _FLOATS else width
            entries.append(
                Entry(index=0x6000, sub=sub, type=kind, role=(role,), bits=bits, slot=slot)  # type: ignore[arg-type] # any of them
            )
            places.append((at, width, kind))
            at, sub = at + width, sub + 1
    objects = (ProcessObject(index=0x1A00, entries=tuple(entries)),)
    return (msgspec.structs.replace(PLAIN, slots=slots, exposures=1, inputs=objects), places)


def test_reads_every_number_where_an_independent_bit_reader_does() -> None:
    """N = 300 layouts with random bits; equal to the last digit."""
    rng = np.random.default_rng(38)
    for _ in range(N_LAYOUTS):
        device, places = random_layout(rng)
        image = ProcessImage(device)
        assert image.input_bytes == (places_end(device) + 7) // 8
        content = rng.bytes(image.input_bytes)
        xy = np.stack([image.numbers(content, role)[0] for role in (Role.X, Role.Y)], axis=-1)
        wanted = [meaning(read_bits(content, at, bits), kind) for at, bits, kind in places]
        np.testing.assert_array_equal(xy.ravel(), wanted)


def places_end(device: DeviceDescription) -> int:
    return sum(entry.width for pdo in device.inputs for entry in pdo.entries)


def test_packs_what_it_reads() -> None:
    """The software camera packs by the same layout: round trip of 300 layouts."""
    rng = np.random.default_rng(39)
    for _ in range(N_LAYOUTS):
        device, places = random_layout(rng)
        image = ProcessImage(device)
        values: dict[tuple[Role, int, int], float] = {}
        for place, (_at, bits, kind) in enumerate(places):
            low = -(1 << (bits - 1)) if kind in _SIGNED else 0
            value = float(rng.integers(low, low + (1 << min(bits, 50))))
            values[(Role.X, Role.Y)[place % 2], 0, place // 2] = value
        content = image.pack_inputs(values)
        for (role, _exposure, slot), value in values.items():
            form = np.float32 if places[0][2] == "REAL32" else np.float64
            assert image.numbers(content, role)[0, slot] == form(value)


def test_translates_spots_with_one_bit_of_validity_each(tmp_path: Path) -> None:
    device = load_device(str(bit_device(tmp_path)))
    image = ProcessImage(device)
    assert (image.input_bytes, image.output_bytes) == ((28 + 12 * 22 + 7) // 8, 3)
    # A heartbeat that shares its bytes matches no answers, but is sent.
    assert image.heartbeat == (0, 0)
    sent = image.pack_outputs(1234)
    assert read_bits(sent, 0, 3) == "101"
    assert int(read_bits(sent, 9, 11), 2) == 1234
    values: dict[tuple[Role, int, int], float] = {
        (Role.BUTTON, -1, -1): 1, (Role.COUNTER, -1, -1): 8191,
    }  # fmt: skip
    for slot in range(6):
        values |= {(Role.X, 0, slot): 100.0 * slot - 256, (Role.Y, 0, slot): 51.0 * slot + 1}
        values[Role.VALID, 0, slot] = slot % 2
    translator = InputTranslator(device, image, 7, None, Timing(10**15, 1_000_000, 0))
    clock = 10**15 + device.latency_ns + 2_300_000
    inputs = translator.translate(image.pack_inputs(values), clock)
    frames = np.frombuffer(inputs, FRAME_DTYPE, count=1, offset=HEADER_STRUCT.size)
    assert int(frames["valid"][0]) == 0b101010
    assert int(frames["flags"][0]) & 1
    uv = decode_spots(frames)[0]
    for slot in (1, 3, 5):
        np.testing.assert_array_equal(uv[slot] * 256, [100 * slot - 256, 51 * slot + 1])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"BITS", bits = 5', '"BITS", bits = 0', "BITS with bits = 0"),
        ('"BITS", bits = 5', '"BITS", bits = 256', "up to 255 if it is ignored"),
        ('"BITS", bits = 13', '"BITS", bits = 65', "length up to 64"),
        ('"BITS", bits = 13', '"BITS", bits = 7', "counter' of 7 bits"),
        ('"DINT", bits = 22', '"DINT", bits = 33', "DINT with bits = 33"),
        ('"DINT", bits = 22', '"REAL32", bits = 22', "REAL32 with bits = 22"),
        ("index = 0, sub = 0", "index = 0, sub = 1", "only pads"),
        ('bits = 5, role = ["ignored"]', 'bits = 5, role = ["button"]', "only pads"),
        ('role = ["valid"], slots = true', 'role = ["valid"]', "1 bit\\(s\\) for 6 slots"),
        ('role = ["valid"], slots = true', 'role = ["valid"], slot = 6', "slots 0 to 5"),
        ('role = ["valid"], slots = true', 'role = ["valid"], slot = 2', "6, each once"),
        ('bits = 3, role = ["constant"], value = 5',
         'bits = 2, role = ["constant"], value = 5', "from 0 to 3"),
        ("6, role = [\"ignored\"] },\n    { index = 0x7000, sub = 2, type = \"BITS\", bits = 11",
         "1, role = [\"ignored\"] },\n    { index = 0x7000, sub = 2, type = \"BITS\", bits = 2",
         "fewer than 8"),
    ],
)  # fmt: skip
def test_refuses_impossible_bits_in_a_sentence(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        load_device(str(bit_device(tmp_path, old, new)))
