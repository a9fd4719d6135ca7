"""The EEPROM as a reader sees it that shares nothing with its writer, against the ESI file."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from xml.etree import ElementTree

import pytest

from ocmm_sim.slave import CONTROLLERS, esi_document, sii_image
from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.direct_camera import DirectCamera

Element = ElementTree.Element


@dataclass
class Eeprom:
    """An image cut into what ETG.2010 names, by byte offsets of its tables."""

    image: bytes

    def __post_init__(self) -> None:
        self.parts: dict[int, list[bytes]] = {}
        at = 0x80
        while (kind := self.image[at] | self.image[at + 1] << 8) != 0xFFFF:
            size = 2 * (self.image[at + 2] | self.image[at + 3] << 8)
            self.parts.setdefault(kind, []).append(self.image[at + 4 : at + 4 + size])
            at += 4 + size
        (texts,) = self.parts[10]
        self.strings = [""]
        at = 1
        for _ in range(texts[0]):
            self.strings.append(texts[at + 1 : at + 1 + texts[at]].decode())
            at += 1 + texts[at]

    def general(self) -> bytes:
        (general,) = self.parts[30]
        return general


def number(text: str | None) -> int:
    assert text
    return int(text[2:], 16) if text.startswith("#x") else int(text)


@pytest.fixture(scope="module")
def root() -> Element:
    return ElementTree.fromstring(esi_document())  # noqa: S314  # our own document


@pytest.fixture(scope="module")
def device(root: Element) -> Element:
    found = root.find("Descriptions/Devices/Device")
    assert found is not None
    return found


@pytest.fixture(scope="module")
def eeprom() -> Eeprom:
    return Eeprom(sii_image(serial=4711, alias=77))


def test_every_entry_of_every_object_has_the_element_that_the_schema_wants(root: Element) -> None:
    parts = root.findall("Descriptions/Devices/Device/Profile/Dictionary/Objects/Object/Info")
    entries = [entry for part in parts for entry in part.findall("SubItem")]
    assert len(entries) > 286
    # ETG.2000: Name, then Info; an empty one is allowed, none is not.
    assert all([child.tag for child in entry] == ["Name", "Info"] for entry in entries)


def test_the_general_category_says_what_the_file_says(
    root: Element, device: Element, eeprom: Eeprom
) -> None:
    general = eeprom.general()
    assert len(general) == 32
    group = root.findtext("Descriptions/Groups/Group/Type")
    assert eeprom.strings[general[0]] == group == device.findtext("GroupType")
    assert general[14] == general[0], "the group stands there twice"
    assert eeprom.strings[general[2]] == device.findtext("Type")
    assert eeprom.strings[general[3]] == device.findtext("Name")
    # Byte 11, bit 2: the mailbox of the data link layer; the others ask for nothing that is there.
    mailbox = device.find("Mailbox")
    assert mailbox is not None
    assert mailbox.get("DataLinkLayer") == "1"
    assert general[11] == 0x04
    # Each nibble a port: Y is MII, 1.
    physics = device.get("Physics", "")
    ports = general[16] | general[17] << 8
    assert [ports >> 4 * place & 0xF for place in range(4)] == [
        {"Y": 1, "K": 3, " ": 0}[letter] for letter in physics.ljust(4)
    ]


def test_the_category_of_the_clock_says_what_the_file_says(device: Element, eeprom: Eeprom) -> None:
    (clock,) = eeprom.parts[60]
    modes = device.findall("Dc/OpMode")
    assert len(clock) == 24 * len(modes) == 48
    for place, mode in enumerate(modes):
        cycle0, shift0, shift1, factor1, activate, factor0, name, words = struct.unpack_from(
            "<IIIhHhBB", clock, 24 * place
        )
        assert eeprom.strings[name] == mode.findtext("Name")
        assert eeprom.strings[words] == mode.findtext("Desc")
        assert activate == number(mode.findtext("AssignActivate"))
        assert (cycle0, shift0, shift1) == (0, 0, 0)
        for tag, found in (("CycleTimeSync0", factor0), ("CycleTimeSync1", factor1)):
            element = mode.find(tag)
            assert found == (0 if element is None else int(element.get("Factor", "0")))
    assert number(modes[0].findtext("AssignActivate")) == 0x0700


def test_all_process_data_are_named_as_in_the_file(device: Element, eeprom: Eeprom) -> None:
    for tag, kind in (("TxPdo", 50), ("RxPdo", 51)):
        listed = device.findall(tag)
        assert len(listed) == len(eeprom.parts[kind])
        for element, content in zip(listed, eeprom.parts[kind], strict=True):
            index, count, _manager, _sync, name, flags = struct.unpack_from("<HBBBBH", content)
            assert index == number(element.findtext("Index"))
            assert eeprom.strings[name] == element.findtext("Name")
            assert bool(flags & 0x0001) == (element.get("Mandatory") == "1")
            assert bool(flags & 0x0010) == (element.get("Fixed") == "1")
            entries = element.findall("Entry")
            names = [content[8 + 8 * place + 3] for place in range(count)]
            assert [eeprom.strings[n] for n in names] == [e.findtext("Name") for e in entries]


def test_the_first_words_turn_the_signals_of_the_clock_on(device: Element, eeprom: Eeprom) -> None:
    written = bytes.fromhex(device.findtext("Eeprom/ConfigData") or "")
    assert written[:8] == eeprom.image[:8] == CONTROLLERS[0].content[:8]
    for controller in CONTROLLERS:
        control, pins, pulse = struct.unpack_from("<3H", controller.content)
        # 0x0151: SYNC0 and SYNC1 are outputs (bits 2 and 6), push-pull and active high.
        assert pins >> 8 & 0b0111_0111 == 0b0110_0110
        assert 0 < pulse * 10 < 125_000
        if control & 0xFF == 0x05:
            # An ET1100 has units that must be enabled (0x0141, bit 2); an IP core has them or not.
            assert control >> 8 & 0x04


def test_every_controller_that_is_named_has_room_for_the_process_data(device: Element) -> None:
    inputs = device.findall("Sm")[3]
    end = number(inputs.get("StartAddress")) + 3 * number(inputs.get("DefaultSize"))
    # An ET1100 has 8 kB from 0x1000 on, an ET1200 1 kB, many others 4 kB.
    assert 0x2000 < end <= 0x3000
    assert not any("ET1200" in each.controller for each in CONTROLLERS)


def test_a_camera_whose_controller_was_told_nothing_gives_no_sync0() -> None:
    camera = DirectCamera()
    camera.esc.write(reg.SYNC_ACTIVATION, b"\x03")
    assert camera.esc.is_synchronised
    for at, length in ((0x0141, 1), (0x0151, 1), (0x0982, 2)):
        kept = bytes(camera.esc.memory[at : at + length])
        camera.esc.memory[at : at + length] = bytes(length)
        assert not camera.esc.is_synchronised, hex(at)
        camera.esc.memory[at : at + length] = kept
    assert camera.esc.is_synchronised
