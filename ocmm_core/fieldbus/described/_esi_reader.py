"""Reader of ESI files (EtherCAT Slave Information, ETG.2000) of other makers.

The file is foreign: its size is limited, document types and entities are refused, and everything
that is not read is listed.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from lxml import etree

from ocmm_core.documents import read_bytes, untrusted_xml
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described._device_file import LONGEST_BITS

_LARGEST = 64 * 2**20
"""The largest published files have some 40 MB."""
_NUMBER = re.compile(r"(?:#x|0x)([0-9a-fA-F]{1,8})|([0-9]{1,10})")
_MOST_ENTRIES, _MOST_DEVICES, _NAME_LENGTH = 4096, 5000, 60
_READ = {"Type", "Name", "Sm", "TxPdo", "RxPdo", "Dc", "Fmmu", "GroupType"}
_SM_KINDS = {0x06: "MBoxOut", 0x02: "MBoxIn", 0x04: "Outputs", 0x00: "Inputs"}
"""By mode and direction in the control byte (ETG.1000.4, table 59): some files omit the name."""
_REMEDY = (
    "Ask the maker for a correct ESI file, or write the description by hand "
    "(docs/technician/wire.md)."
)


@dataclass(frozen=True, slots=True)
class EsiEntry:
    """An entry of a process data object; index 0 is a gap."""

    index: int
    sub: int
    bits: int
    name: str
    type: str
    """Name of the data type in the file; empty if not stated."""

    @property
    def key(self) -> str:
        """Return its name in statements."""
        return f"{self.index:#06x}:{self.sub:02x}"


@dataclass(frozen=True, slots=True)
class EsiObject:
    """A process data object."""

    index: int
    name: str
    assigned: bool
    """Whether it is mapped by default: it names a sync manager."""
    entries: tuple[EsiEntry, ...]


@dataclass(frozen=True, slots=True)
class EsiSyncManager:
    """A sync manager; size 0 if not stated."""

    kind: str
    start: int
    size: int


@dataclass(frozen=True, slots=True)
class EsiDevice:
    """A device of an ESI file."""

    vendor: int
    product: int
    revision: int
    name: str
    sync_managers: tuple[EsiSyncManager, ...]
    inputs: tuple[EsiObject, ...]
    outputs: tuple[EsiObject, ...]
    has_clock: bool
    """Whether a mode with SYNC0 of the distributed clock is listed."""
    left_out: tuple[str, ...]
    """Parts of the file that no description can hold."""


def choose_device(path: Path, product: int | None = None, revision: int | None = None) -> EsiDevice:
    """Return one device of an ESI file.

    Raises
    ------
    InputError
        The file is unusable, holds no such device, several, or two different ones of one identity.
    """
    root = _root(path)
    vendor = _number(path, "Vendor/Id", root.findtext("Vendor/Id"))
    nodes = root.findall("Descriptions/Devices/Device")
    if not 0 < len(nodes) <= _MOST_DEVICES:
        raise _refused(path, f"it describes {len(nodes)} devices")
    found: dict[tuple[int, int], list[etree._Element]] = {}
    for node in nodes:
        kind = _only(path, node, "Type")
        code = _number(path, "ProductCode", kind.get("ProductCode"))
        version = _number(path, "RevisionNo", kind.get("RevisionNo", "0"))
        if product in (None, code) and revision in (None, version):
            found.setdefault((code, version), []).append(node)
    if len(found) != 1:
        listed = [f"{code:#010x} revision {version:#010x}" for code, version in found][:20]
        raise InputError(
            "esi.device",
            f"{path}: {len(found)} of {len(nodes)} devices match"
            f"{': ' if listed else ''}{', '.join(listed)}.",
            "Choose one with --product and --revision; its label or 'ocmm bus scan' states them.",
        )
    ((identity, twins),) = found.items()
    devices = [_device(path, vendor, identity, node) for node in twins]
    if any(one != devices[0] for one in devices):
        raise _refused(
            path, f"device {identity[0]:#010x} revision {identity[1]:#010x} is there "
            f"{len(devices)} times, and not the same each time",
        )  # fmt: skip
    others = len(nodes) - len(twins)
    left = [*devices[0].left_out]
    if others:
        left.append(f"{others} other devices of the file")
    if modules := root.findall("Descriptions/Modules/Module"):
        left.append(f"{len(modules)} modules")
    return replace(devices[0], left_out=tuple(left))


def _device(path: Path, vendor: int, identity: tuple[int, int], node: etree._Element) -> EsiDevice:
    managers = tuple(
        EsiSyncManager(
            kind,
            _number(path, "Sm/StartAddress", sm.get("StartAddress")),
            _number(path, "Sm/DefaultSize", sm.get("DefaultSize", "0")),
        )
        for sm in node.findall("Sm")
        if (kind := _sm_kind(path, sm)) in _SM_KINDS.values()
    )
    inputs, outputs = (
        tuple(_object(path, pdo) for pdo in node.findall(tag)) for tag in ("TxPdo", "RxPdo")
    )
    modes = node.findall("Dc/OpMode")
    activated = [
        _number(path, "Dc/OpMode/AssignActivate", mode.findtext("AssignActivate", "0"))
        for mode in modes
    ]
    counted = Counter(str(child.tag) for child in node if str(child.tag) not in _READ)
    left = [f"{count} x {tag[:_NAME_LENGTH]}" for tag, count in sorted(counted.items())]
    left += [
        f"{word} object {pdo.index:#06x} '{pdo.name}' (optional, not mapped by default)"
        for word, objects in (("input", inputs), ("output", outputs))
        for pdo in objects
        if not pdo.assigned
    ]
    commands = node.findall(".//InitCmd")
    if commands:
        left.append(f"{len(commands)} start-up values (add them as [[start_up]] if needed)")
    name = _text(_only(path, node, "Type")) or node.findtext("Name", "")
    return EsiDevice(
        vendor, *identity, _short(name), managers, inputs, outputs,
        any(value & 0x0100 for value in activated), tuple(left),
    )  # fmt: skip


def _sm_kind(path: Path, node: etree._Element) -> str:
    control = node.get("ControlByte")
    if _text(node) or control is None:
        return _text(node)
    return _SM_KINDS.get(_number(path, "Sm/ControlByte", control) & 0x0F, "")


def _object(path: Path, node: etree._Element) -> EsiObject:
    first = node.find("Index")
    if first is not None and first.get("DependOnSlot", "0") not in ("0", "false"):
        raise _refused(path, "its process data depend on the slot of a module")
    index = _number(path, f"{node.tag}/Index", node.findtext("Index"))
    nodes = node.findall("Entry")
    if len(nodes) > _MOST_ENTRIES:
        raise _refused(path, f"object {index:#06x} has {len(nodes)} entries")
    entries = []
    for entry in nodes:
        place = _number(path, f"Entry/Index of {index:#06x}", entry.findtext("Index"))
        sub = _number(path, f"Entry/SubIndex of {index:#06x}", entry.findtext("SubIndex", "0"))
        bits = _number(path, f"Entry/BitLen of {index:#06x}", entry.findtext("BitLen"))
        if not 0 < bits <= LONGEST_BITS:
            raise _refused(path, f"entry {place:#06x}:{sub:02x} has {bits} bits")
        name, kind = entry.findtext("Name", ""), entry.findtext("DataType", "")
        entries.append(
            EsiEntry(place, sub if place else 0, bits, _short(name), _short(kind).upper())
        )
    assigned = node.get("Sm") is not None
    return EsiObject(index, _short(node.findtext("Name", "")), assigned, tuple(entries))


def _root(path: Path) -> etree._Element:
    try:
        root = untrusted_xml(read_bytes(path, _LARGEST))
    except ValueError as error:
        raise _refused(path, _short(str(error), 200)) from error
    if root.tag != "EtherCATInfo":
        raise _refused(path, f"it starts with '{_short(str(root.tag))}', not with EtherCATInfo")
    return root


def _only(path: Path, node: etree._Element, tag: str) -> etree._Element:
    found = node.findall(tag)
    if len(found) != 1:
        raise _refused(path, f"a device has {len(found)} elements {tag}")
    return found[0]


def _number(path: Path, field: str, text: str | None) -> int:
    found = _NUMBER.fullmatch((text or "").strip())
    if found is None:
        raise _refused(path, f"{field} is {_short(text or '')!r}, which is not a number")
    return int(found[1], 16) if found[1] else int(found[2])


def _text(node: etree._Element) -> str:
    return (node.text or "").strip()


def _short(text: str, most: int = _NAME_LENGTH) -> str:
    """Return the beginning of a foreign text, printable and in one line."""
    words = " ".join(text[:2000].split())[:most]
    return "".join(sign if sign.isprintable() else "?" for sign in words)


def _refused(path: Path, why: str) -> InputError:
    return InputError("esi.unusable", f"{path}: not a usable ESI file: {why}.", _REMEDY)
