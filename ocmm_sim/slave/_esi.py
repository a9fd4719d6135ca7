"""ESI file of the smart camera (ETG.2000), for other masters, and EEPROM of its controller."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from xml.etree import ElementTree

from ocmm_core.fieldbus import device as model
from ocmm_core.fieldbus.device import DataType, DictionaryObject, ObjectEntry

SII_BYTES = 4096
DEVICE_GROUP = "OpticalSensors"
"""Device group in ESI file and EEPROM."""
PHYSICAL_PORTS = 0x0011
"""A nibble per port, port 0 first: two MII ports, the others absent (YY in the ESI file)."""
MAILBOX_REPEATS = 0x04
"""Bit in the category General: mailboxes are repeated on request; `DataLinkLayer` in ESI."""
MEMORY_END = model.INPUT_START + 3 * model.INPUT_DTYPE.itemsize
"""Required controller memory: process data have three consecutive buffers."""
SYNC_PULSE_NS = 10_000
"""Pulse length of SYNC0 and SYNC1: shorter than their shortest distance."""


@dataclass(frozen=True, slots=True)
class ControllerWords:
    """Configuration loaded from a controller's EEPROM (ETG.1000.4, PDI registers)."""

    controller: str
    """The chip, and its connection to the camera's processor."""
    pdi_control: int
    """Registers 0x0140 and 0x0141: low byte PDI type (5: SPI, 0x80: on-chip bus); high byte bit 1
    enhanced link detection, and on an ET1100 bit 2 the SYNC0/SYNC1 output unit, without which no
    signal appears."""
    pdi_configuration: int
    """Registers 0x0150 and 0x0151: low byte PDI (SPI mode 3), high byte pins. 0xEE: both are
    outputs, push-pull, active high, and raise an interrupt. 0 makes them inputs."""

    @property
    def content(self) -> bytes:
        """Return the first 14 bytes of the EEPROM, without station alias."""
        pulse = SYNC_PULSE_NS // 10
        return struct.pack("<7H", self.pdi_control, self.pdi_configuration, pulse, 0, 0, 0, 0)


CONTROLLERS = (
    ControllerWords("ET1100, connected by SPI", 0x0E05, 0xEE03),
    ControllerWords("IP core in the camera's FPGA, on-chip bus", 0x0280, 0xEE00),
)
"""The first is used by ESI file and software camera; use another entry's words for other hardware.
"""
SII_CONFIGURATION = CONTROLLERS[0].content
"""First words of the EEPROM without station alias, loaded at power-on."""
DC_ACTIVATE = 0x0700
"""Value of the activation register (0x0980) for both signals."""


@dataclass(frozen=True, slots=True)
class ClockMode:
    """A distributed clock mode offered in ESI file and EEPROM."""

    name: str
    text: str
    activate: int
    sync0_factor: int = 0
    sync1_factor: int = 0
    """`sync0_factor`, `sync1_factor`: of the bus cycle; negative: fraction, positive: multiple."""


CLOCK_MODES = (
    ClockMode(
        "DcSync",
        f"Exposures at SYNC0, 8 in a bus cycle ({model.DEFAULT_FRAME_PERIOD_NS} ns at 1 ms)",
        DC_ACTIVATE, sync0_factor=-8, sync1_factor=1,
    ),
    ClockMode("FreeRun", "Exposures by the camera's own clock; for commissioning", 0),
)  # fmt: skip


ESI_FILE = ("ethercat", "ocmm_camera.xml")

_BOOTSTRAP = (
    struct.pack(
        "<HHHH",
        model.MAILBOX_OUT_START,
        model.MAILBOX_BYTES,
        model.MAILBOX_IN_START,
        model.MAILBOX_BYTES,
    )
    .hex()
    .upper()
)
"""Mailboxes in BOOT, at fixed addresses."""
_ENGLISH = "1033"
_COUNT_BITS = 16
"""Size of entry 0 in a record."""
_TYPE_NAMES = {DataType.BOOLEAN: "BOOL"}
_SM_NAMES = ("MBoxOut", "MBoxIn", "Outputs", "Inputs")

Element = ElementTree.Element


def esi_document() -> bytes:
    root = Element("EtherCATInfo", {"Version": "1.6"})
    vendor = _add(root, "Vendor")
    _add(vendor, "Id", _hex(model.VENDOR_ID, 8))
    _add(vendor, "Name", model.VENDOR_NAME)
    descriptions = _add(root, "Descriptions")
    group = _add(_add(descriptions, "Groups"), "Group")
    _add(group, "Type", DEVICE_GROUP)
    _add(group, "Name", "Optical sensors", LcId=_ENGLISH)
    device = _add(_add(descriptions, "Devices"), "Device", Physics="YY")
    _add(
        device, "Type", model.DEVICE_NAME,
        ProductCode=_hex(model.PRODUCT_CODE, 8), RevisionNo=_hex(model.REVISION, 8),
    )  # fmt: skip
    _add(device, "Name", model.DEVICE_NAME, LcId=_ENGLISH)
    _add(device, "GroupType", DEVICE_GROUP)
    _add_profile(device)
    for name in ("Outputs", "Inputs"):
        _add(device, "Fmmu", name)
    for name, (start, size, control, _status, active, _kind) in zip(
        _SM_NAMES, model.SYNC_MANAGERS, strict=True
    ):
        _add(
            device, "Sm", name,
            MinSize=str(size), MaxSize=str(size), DefaultSize=str(size),
            StartAddress=_hex(start, 4), ControlByte=_hex(control, 2), Enable=str(active),
        )  # fmt: skip
    _add_pdo(device, "RxPdo", model.OUTPUT_PDO, model.SM_OUTPUTS)
    for pdo in model.INPUT_PDOS:
        _add_pdo(device, "TxPdo", pdo, model.SM_INPUTS)
    mailbox = _add(device, "Mailbox", DataLinkLayer="1")
    _add(
        mailbox, "CoE",
        SdoInfo="1", PdoAssign="0", PdoConfig="0", CompleteAccess="1", SegmentedSdo="1",
        DiagHistory="1",
    )  # fmt: skip
    _add(mailbox, "FoE")
    _add_clock(device)
    eeprom = _add(device, "Eeprom")
    _add(eeprom, "ByteSize", str(SII_BYTES))
    _add(eeprom, "ConfigData", SII_CONFIGURATION.hex().upper())
    _add(eeprom, "BootStrap", _BOOTSTRAP)
    ElementTree.indent(root, "  ")
    text = ElementTree.tostring(root, "unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def type_name(entry: ObjectEntry) -> str:
    if entry.kind == DataType.VISIBLE_STRING:
        return f"STRING({entry.room})"
    if entry.kind == DataType.OCTET_STRING:
        return f"OCTET_STRING({entry.room})"
    return _TYPE_NAMES.get(entry.kind, entry.kind.name)


def _add(parent: Element, tag: str, text: str | None = None, **attributes: str) -> Element:
    element = ElementTree.SubElement(parent, tag, attributes)
    element.text = text
    return element


def _hex(value: int, digits: int) -> str:
    return f"#x{value:0{digits}X}"


def _add_profile(device: Element) -> None:
    profile = _add(device, "Profile")
    _add(profile, "ProfileNo", str(model.DEVICE_TYPE & 0xFFFF))
    dictionary = _add(profile, "Dictionary")
    types = _add(dictionary, "DataTypes")
    objects = model.object_dictionary(serial=0)
    simple = {
        type_name(entry): entry.bits for item in objects.values() for entry in item.entries.values()
    }
    for name, bits in sorted(simple.items()):
        kind = _add(types, "DataType")
        _add(kind, "Name", name)
        _add(kind, "BitSize", str(bits))
    for index, item in objects.items():
        if item.record:
            _add_record_type(types, index, item)
    listed = _add(dictionary, "Objects")
    for index, item in objects.items():
        _add_object(listed, index, item)
    messages = _add(profile, "DiagMessages")
    for code, text in model.ERROR_TEXTS.items():
        if code is not model.ErrorCode.RESET:
            message = _add(messages, "DiagMessage")
            _add(message, "TextId", _hex(code, 4))
            _add(message, "MessageText", text, LcId=_ENGLISH)


def _room_bits(sub: int, entry: ObjectEntry) -> int:
    """Return the size of an entry in its record."""
    # A bit is padded to a byte, so that all other entries start on a byte.
    return max(8, entry.bits) if sub else _COUNT_BITS


def _add_record_type(types: Element, index: int, item: DictionaryObject) -> None:
    kind = _add(types, "DataType")
    _add(kind, "Name", f"DT{index:04X}")
    size = _add(kind, "BitSize")
    at = 0
    for sub, entry in item.entries.items():
        part = _add(kind, "SubItem")
        _add(part, "SubIdx", str(sub))
        _add(part, "Name", entry.name)
        _add(part, "Type", type_name(entry))
        _add(part, "BitSize", str(entry.bits))
        _add(part, "BitOffs", str(at))
        _add_flags(part, index, entry)
        at += _room_bits(sub, entry)
    size.text = str(at)


def _add_object(objects: Element, index: int, item: DictionaryObject) -> None:
    element = _add(objects, "Object")
    _add(element, "Index", _hex(index, 4))
    _add(element, "Name", item.name)
    first = item.entries[0]
    _add(element, "Type", f"DT{index:04X}" if item.record else type_name(first))
    if item.record:
        size = sum(_room_bits(sub, entry) for sub, entry in item.entries.items())
        _add(element, "BitSize", str(size))
        info = _add(element, "Info")
        for entry in item.entries.values():
            part = _add(info, "SubItem")
            _add(part, "Name", entry.name)
            # The ETG schema requires it even without a default.
            _add_default(_add(part, "Info"), entry)
    else:
        _add(element, "BitSize", str(first.bits))
        if _has_default(first):
            _add_default(_add(element, "Info"), first)
    _add_flags(element, index, first)


def _has_default(entry: ObjectEntry) -> bool:
    return bool(entry.value) and not entry.live


def _add_default(info: Element, entry: ObjectEntry) -> None:
    if _has_default(entry):
        _add(info, "DefaultData", entry.value.hex().upper())


def _add_flags(parent: Element, index: int, entry: ObjectEntry) -> None:
    flags = _add(parent, "Flags")
    access = _add(flags, "Access", "rw" if entry.writable else "ro")
    if entry.preop_only:
        access.set("WriteRestrictions", "PreOP")
    if entry.mapped:
        is_output = index == model.OUTPUT_PDO.entries[0].index
        _add(flags, "PdoMapping", "R" if is_output else "T")


def _add_pdo(device: Element, tag: str, pdo: model.Pdo, sync_manager: int) -> None:
    element = _add(device, tag, Fixed="1", Mandatory="1", Sm=str(sync_manager))
    _add(element, "Index", _hex(pdo.index, 4))
    _add(element, "Name", pdo.name)
    for variable in pdo.entries:
        entry = _add(element, "Entry")
        _add(entry, "Index", _hex(variable.index, 4))
        _add(entry, "SubIndex", str(variable.sub))
        _add(entry, "BitLen", str(variable.bits))
        _add(entry, "Name", variable.name)
        _add(entry, "DataType", variable.kind.name)


def _add_clock(device: Element) -> None:
    clock = _add(device, "Dc")
    for mode in CLOCK_MODES:
        found = _add(clock, "OpMode")
        _add(found, "Name", mode.name)
        _add(found, "Desc", mode.text)
        _add(found, "AssignActivate", _hex(mode.activate, 4))
        if mode.activate:
            _add(found, "CycleTimeSync0", "0", Factor=str(mode.sync0_factor))
            _add(found, "ShiftTimeSync0", "0")
            _add(found, "CycleTimeSync1", "0", Factor=str(mode.sync1_factor))
