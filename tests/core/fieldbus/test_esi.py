"""The ESI file: complete, and consistent with EEPROM and dictionary."""

from __future__ import annotations

import struct
from xml.etree import ElementTree

import pytest

from ocmm_core.fieldbus.device import ErrorCode, object_dictionary
from ocmm_core.fieldbus.device import _camera_slave as model
from ocmm_core.fieldbus.device._camera_objects import ERROR_TEXTS
from ocmm_sim.slave import esi_document, sii_image

Element = ElementTree.Element

# Elements of a device description, in the order of ETG.2000.
DEVICE_ORDER = (
    "Type", "Name", "GroupType", "Profile", "Fmmu", "Sm", "RxPdo", "TxPdo", "Mailbox", "Dc",
    "Eeprom",
)  # fmt: skip
TYPE_BITS = {
    "BOOL": 1, "USINT": 8, "INT": 16, "UINT": 16, "DINT": 32, "UDINT": 32, "ULINT": 64,
}  # fmt: skip


@pytest.fixture(scope="module")
def device() -> Element:
    root = ElementTree.fromstring(esi_document())  # noqa: S314  # our own document
    found = root.find("Descriptions/Devices/Device")
    assert found is not None
    return found


def text(element: Element, path: str) -> str:
    found = element.findtext(path)
    assert found, f"{element.tag} has no {path}"
    return found


def number(value: str) -> int:
    return int(value[2:], 16) if value.startswith("#x") else int(value)


def categories(image: bytes) -> list[tuple[int, bytes]]:
    found, at = [], 0x80
    while (kind := struct.unpack_from("<H", image, at)[0]) != 0xFFFF:
        size = 2 * struct.unpack_from("<H", image, at + 2)[0]
        found.append((kind, image[at + 4 : at + 4 + size]))
        at += 4 + size
    return found


def test_the_structure_is_that_of_an_esi_file(device: Element) -> None:
    root = ElementTree.fromstring(esi_document())  # noqa: S314  # our own document
    assert [child.tag for child in root] == ["Vendor", "Descriptions"]
    assert number(text(root, "Vendor/Id")) == model.VENDOR_ID
    groups = [text(group, "Type") for group in root.iterfind("Descriptions/Groups/Group")]
    assert text(device, "GroupType") in groups
    tags = [child.tag for child in device]
    assert tags == sorted(tags, key=DEVICE_ORDER.index)
    assert set(tags) == set(DEVICE_ORDER)
    for element in device.iter():
        said = len(element) or (element.text or "").strip() or element.attrib
        assert said or element.tag in ("Info", "FoE"), element.tag
    # A name that a tool compares must not be there twice.
    for path in ("DataTypes/DataType/Name", "Objects/Object/Index"):
        values = [item.text for item in device.iterfind(f"Profile/Dictionary/{path}")]
        assert len(values) == len(set(values))


def test_every_type_exists_and_records_have_room_for_their_entries(device: Element) -> None:
    sizes = {}
    for kind in device.iterfind("Profile/Dictionary/DataTypes/DataType"):
        name, bits = text(kind, "Name"), number(text(kind, "BitSize"))
        sizes[name] = bits
        if name in TYPE_BITS:
            assert bits == TYPE_BITS[name]
        end = 0
        for part in kind.iterfind("SubItem"):
            assert sizes[text(part, "Type")] == number(text(part, "BitSize"))
            at = number(text(part, "BitOffs"))
            assert at >= end
            assert at % 8 == 0
            end = at + number(text(part, "BitSize"))
        assert end <= bits
    for item in device.iterfind("Profile/Dictionary/Objects/Object"):
        assert sizes[text(item, "Type")] == number(text(item, "BitSize"))


def test_the_file_lists_every_object_of_the_dictionary(device: Element) -> None:
    objects = object_dictionary(serial=0)
    dictionary = device.find("Profile/Dictionary")
    assert dictionary is not None
    types = {text(kind, "Name"): kind for kind in dictionary.iterfind("DataTypes/DataType")}
    listed = {
        number(text(item, "Index")): item
        for item in device.iterfind("Profile/Dictionary/Objects/Object")
    }
    assert list(listed) == list(objects)
    for index, item in objects.items():
        element = listed[index]
        assert text(element, "Name") == item.name
        if not item.record:
            assert text(element, "Flags/Access") == ("rw" if item.entries[0].writable else "ro")
            continue
        parts = types[text(element, "Type")].findall("SubItem")
        assert [number(text(part, "SubIdx")) for part in parts] == list(item.entries)
        for part, entry in zip(parts, item.entries.values(), strict=True):
            assert text(part, "Name") == entry.name
            assert number(text(part, "BitSize")) == entry.bits
            access = part.find("Flags/Access")
            assert access is not None
            assert access.text == ("rw" if entry.writable else "ro")
            assert (access.get("WriteRestrictions") == "PreOP") == entry.preop_only
        defaults = element.findall("Info/SubItem")
        for default, entry in zip(defaults, item.entries.values(), strict=True):
            data = default.findtext("Info/DefaultData")
            assert data is None or bytes.fromhex(data) == entry.value


def test_identity_and_eeprom_agree(device: Element) -> None:
    image = sii_image(serial=4711, alias=7)
    kind = device.find("Type")
    assert kind is not None
    vendor, product, revision, _serial = struct.unpack_from("<IIII", image, 16)
    assert number(kind.get("ProductCode", "")) == product == model.PRODUCT_CODE
    assert number(kind.get("RevisionNo", "")) == revision == model.REVISION
    assert vendor == model.VENDOR_ID
    assert number(text(device, "Eeprom/ByteSize")) == len(image)
    written = bytearray.fromhex(text(device, "Eeprom/ConfigData"))
    struct.pack_into("<H", written, 8, 7)
    assert bytes(written) == image[:14]
    strings = dict(categories(image))[10]
    assert kind.text is not None
    assert kind.text.encode() in strings


def test_sync_managers_and_mailboxes_agree(device: Element) -> None:
    image = sii_image(serial=1, alias=1)
    managers = dict(categories(image))[41]
    listed = device.findall("Sm")
    assert [manager.text for manager in listed] == ["MBoxOut", "MBoxIn", "Outputs", "Inputs"]
    for place, manager in enumerate(listed):
        start, size, control, _status, enable, kind = struct.unpack_from(
            "<HHBBBB", managers, 8 * place
        )
        assert number(manager.get("StartAddress", "")) == start
        assert number(manager.get("DefaultSize", "")) == size
        assert number(manager.get("ControlByte", "")) == control
        assert number(manager.get("Enable", "")) == enable
        assert kind == place + 1
    mailboxes = struct.unpack_from("<HHHHH", image, 0x30)
    assert mailboxes[:2] == (number(listed[0].get("StartAddress", "")), model.MAILBOX_BYTES)
    assert mailboxes[2:4] == (number(listed[1].get("StartAddress", "")), model.MAILBOX_BYTES)
    details = dict(categories(image))[30][5]
    coe = device.find("Mailbox/CoE")
    assert coe is not None
    bits = [coe.get(name) == "1" for name in ("SdoInfo", "PdoAssign", "PdoConfig")]
    assert bits == [bool(details & bit) for bit in (2, 4, 8)]
    assert (coe.get("CompleteAccess") == "1") == bool(details & 0x20)
    fmmu = [{"Outputs": 1, "Inputs": 2}[unit.text or ""] for unit in device.iterfind("Fmmu")]
    assert bytes(fmmu) == dict(categories(image))[40]


def test_mapping_agrees_with_eeprom_and_dictionary(device: Element) -> None:
    objects = object_dictionary(serial=1)
    image = sii_image(serial=1, alias=1)
    in_eeprom = [content for kind, content in categories(image) if kind in (50, 51)]
    in_file = [*device.findall("TxPdo"), *device.findall("RxPdo")]
    assert len(in_file) == len(in_eeprom) == len(model.INPUT_PDOS) + 1
    total = {"TxPdo": 0, "RxPdo": 0}
    for element, content in zip(in_file, in_eeprom, strict=True):
        index, count, manager = struct.unpack_from("<HBB", content)
        entries = element.findall("Entry")
        assert number(text(element, "Index")) == index
        assert number(element.get("Sm", "")) == manager
        assert len(entries) == count
        mapping = objects[index].entries
        assert mapping[0].value == bytes([count])
        for place, entry in enumerate(entries):
            where, sub, _name, kind, bits, _flags = struct.unpack_from(
                "<HBBBBH", content, 8 + 8 * place
            )
            found = tuple(number(text(entry, tag)) for tag in ("Index", "SubIndex", "BitLen"))
            assert found == (where, sub, bits)
            word = struct.pack("<I", where << 16 | sub << 8 | bits)
            assert mapping[place + 1].value == word
            assert model.DataType[text(entry, "DataType")] == kind
            target = objects[where].entries[sub]
            assert (target.name, target.kind, target.bits) == (text(entry, "Name"), kind, bits)
            assert target.mapped
            total[element.tag] += bits
    assert total["TxPdo"] == 8 * model.INPUT_DTYPE.itemsize
    assert total["RxPdo"] == 8 * model.OUTPUT_DTYPE.itemsize


def test_messages_of_the_history_have_a_text(device: Element) -> None:
    texts = {
        number(text(message, "TextId")): text(message, "MessageText")
        for message in device.iterfind("Profile/DiagMessages/DiagMessage")
    }
    expected = {code: words for code, words in ERROR_TEXTS.items() if code is not ErrorCode.RESET}
    assert texts == expected
    assert set(ERROR_TEXTS) == set(ErrorCode)
