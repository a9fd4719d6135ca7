"""Conversion of an ESI device to a device description `ocmm.device/1`.

An ESI file states places and types of process data, never their meaning. The user states roles,
units, scale and clock; missing statements are listed, nothing is guessed.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described._device_check import load_device
from ocmm_core.fieldbus.described._device_file import FORMATS, SCHEMA, Clock, Role, Sends, TypeName
from ocmm_core.fieldbus.described._esi_reader import EsiDevice, EsiEntry, EsiObject

_ALIASES: dict[str, TypeName] = {
    "BYTE": "USINT", "WORD": "UINT", "DWORD": "UDINT", "LWORD": "ULINT", "REAL": "REAL32",
    "LREAL": "REAL64", "BIT": "BOOL",
}  # fmt: skip
_ODD = {
    f"{sign}INT{bits}": (f"{sign}{'D' if bits < 32 else 'L'}INT", bits)
    for sign in ("", "U")
    for bits in (24, 40, 48, 56)
}
"""Integers of 3, 5, 6 and 7 bytes (ETG.1000.6, table 63)."""
_PER_SLOT = (Role.X, Role.Y, Role.INTENSITY, Role.VALID)
_IN_ROLES = (*_PER_SLOT, Role.COUNTER, Role.TIME, Role.BUTTON)


@dataclass(frozen=True, slots=True)
class EsiStatements:
    """Statements of the user about a device, in addition to its ESI file."""

    roles: Mapping[Role, tuple[str, ...]] = field(default_factory=dict)
    """Entries by role, ``"0x6000:01"``; those of spots in the order of the slots."""
    constants: Mapping[str, int] = field(default_factory=dict)
    """Values of output entries."""
    sends: Sends | None = None
    step: float | None = None
    clock: Clock | None = None
    doubt_ns: int | None = None
    cycle_ns: int = 1_000_000
    latency_ns: int = 0


def missing_statements(device: EsiDevice, stated: EsiStatements) -> tuple[str, ...]:
    """Return the missing statements, in sentences."""
    inputs = {one.key for one in _entries(device.inputs) if one.index}
    outputs = {one.key for one in _entries(device.outputs) if one.index}
    found = [
        f"Which entries are '{role}' of the spots? Give --role {role}=INDEX:SUB,... in the order "
        "of the slots."
        for role in (Role.X, Role.Y)
        if not stated.roles.get(role)
    ]
    if not inputs:
        found.append("The file maps no inputs: the device itself holds the mapping.")
    counts = {len(stated.roles[role]) for role in (Role.X, Role.Y) if stated.roles.get(role)}
    if len(counts) > 1:
        found.append("There are not as many entries 'x' as 'y': give both for every slot.")
    for role, keys in stated.roles.items():
        known = outputs if role is Role.HEARTBEAT else inputs
        found += [
            f"There is no mapped entry {key} for '{role}'." for key in keys if key not in known
        ]
        per_slot = role in (Role.X, Role.Y, Role.INTENSITY)
        if per_slot and counts and len(keys) not in counts:
            found.append(f"'{role}' has {len(keys)} entries, but the camera {max(counts)} slots.")
        if role not in (*_IN_ROLES, Role.HEARTBEAT) or (role not in _PER_SLOT and len(keys) > 1):
            found.append(f"'{role}' cannot be stated for {len(keys)} entries.")
    told = [key for keys in stated.roles.values() for key in keys]
    found += sorted({f"Entry {key} has two roles." for key in told if told.count(key) > 1})
    found += [f"There is no mapped output {key}." for key in stated.constants if key not in outputs]
    found += [
        f"Which value is sent in the output {one.key} '{one.name}'? Give --output {one.key}=VALUE, "
        f"or --role heartbeat={one.key}."
        for one in _entries(device.outputs)
        if one.index
        and one.key not in stated.constants
        and one.key not in stated.roles.get(Role.HEARTBEAT, ())
    ]
    if stated.sends is None:
        found.append(
            "In which unit are the coordinates? Give --sends: "
            f"{', '.join(repr(str(unit)) for unit in Sends)}."
        )
    if stated.step is None:
        found.append("How many px or mm is one step of a coordinate? Give --step.")
    if stated.clock is None or stated.doubt_ns is None:
        found.append(
            "By which clock does it expose, and how well is the time known? Give --clock "
            "distributed or arrival, and --doubt-ns."
        )
    if stated.clock is Clock.DISTRIBUTED and not device.has_clock:
        found.append("The file lists no mode with SYNC0, so its clock is not the distributed one.")
    for kind, what in (("MBoxOut", "mailbox out"), ("MBoxIn", "mailbox in"),
                       ("Outputs", "outputs"), ("Inputs", "inputs")):  # fmt: skip
        managers = [one for one in device.sync_managers if one.kind == kind]
        if len(managers) != 1:
            found.append(
                f"The device has {len(managers)} sync managers for the {what}; a camera needs one "
                "(its serial number is read by mailbox)."
            )
        elif kind.startswith("MBox") and not managers[0].size:
            found.append(f"The file does not state the size of the {what}.")
    return tuple(found)


def describe_esi(device: EsiDevice, stated: EsiStatements) -> str:
    """Return the text of a description, checked as `load_device` checks it.

    Raises
    ------
    InputError
        A statement is missing, or the result does not describe a camera.
    """
    missing = missing_statements(device, stated)
    if missing or stated.sends is None or stated.clock is None:
        raise InputError(
            "esi.statements",
            " ".join(missing),
            "The manual of the camera states them; the ESI file does not.",
        )
    places = {one.kind: one for one in device.sync_managers}
    out, into = places["MBoxOut"], places["MBoxIn"]
    roles = {
        key: (role, slot if role in _PER_SLOT and (role is not Role.VALID or len(keys) > 1) else -1)
        for role, keys in stated.roles.items()
        for slot, key in enumerate(keys)
    }
    lines = [
        f'schema = "{SCHEMA}"', 'unit = "mm"', f"name = {_quoted(device.name)}",
        f"vendor = {device.vendor:#x}", f"product = {device.product:#x}",
        f"revisions = [{device.revision:#x}, {device.revision:#x}]",
        f'sends = "{stated.sends}"', f"step = {stated.step!r}",
        f"slots = {len(stated.roles[Role.X])}", "exposures = 1", f'clock = "{stated.clock}"',
        f"doubt_ns = {stated.doubt_ns}", f"cycle_ns = {stated.cycle_ns}",
        f"latency_ns = {stated.latency_ns}",
        f"mailbox = [{out.start:#x}, {out.size}, {into.start:#x}, {into.size}]",
        f"memory = [{places['Outputs'].start:#x}, {places['Inputs'].start:#x}]",
    ]  # fmt: skip
    for word, objects in (("inputs", device.inputs), ("outputs", device.outputs)):
        for pdo in objects:
            if pdo.assigned:
                lines += ["", f"[[{word}]]", f"index = {pdo.index:#x}", "entries = ["]
                lines += [f"    {_entry(one, roles, stated)}," for one in pdo.entries]
                lines.append("]")
    text = "\n".join(lines) + "\n"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "description.toml"
        path.write_text(text, encoding="utf-8")
        load_device(str(path))
    return text


def _entry(one: EsiEntry, roles: Mapping[str, tuple[Role, int]], stated: EsiStatements) -> str:
    role, slot = roles.get(one.key, (Role.IGNORED, -1)) if one.index else (Role.IGNORED, -1)
    value = stated.constants.get(one.key)
    kind, bits = _type(one)
    if role is Role.IGNORED and value is not None:
        role = Role.CONSTANT
    if role is Role.IGNORED:
        kind, bits = "BITS", one.bits
    elif kind is None:
        raise InputError(
            "esi.type",
            f"Entry {one.key} '{one.name}' is '{role}', but its type '{one.type}' of {one.bits} "
            "bits is not a number that is known here.",
            "Write the description by hand (docs/technician/wire.md).",
        )
    parts = [f"index = {one.index:#x}", f"sub = {one.sub}", f'type = "{kind}"']
    parts += [f"bits = {bits}"] if bits else []
    parts += [f'role = ["{role}"]']
    parts += [f"slot = {slot}"] if slot >= 0 else []
    parts += [f"value = {value}"] if role is Role.CONSTANT else []
    return "{ " + ", ".join(parts) + " }"


def _type(one: EsiEntry) -> tuple[str | None, int]:
    """Return type and length of an entry; None if its type is not a number of that length."""
    kind, whole = _ODD.get(one.type, (_ALIASES.get(one.type, one.type), 0))
    if whole:
        return (kind, whole) if whole == one.bits else (None, 0)
    if one.type.startswith("BIT"):
        return ("BOOL", 0) if one.bits == 1 else ("BITS", one.bits)
    sizes = {name: 8 * int(form[2]) for name, form in FORMATS.items()} | {"BOOL": 1, "BITS": 0}
    return (kind, 0) if sizes.get(kind) == one.bits else (None, 0)  # type: ignore[call-overload] # any text


def _entries(objects: tuple[EsiObject, ...]) -> list[EsiEntry]:
    return [entry for pdo in objects if pdo.assigned for entry in pdo.entries]


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
