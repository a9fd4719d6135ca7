"""Loading and checking of device descriptions."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec

from ocmm_core.documents import load_document, resource
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import _device_places as device_places
from ocmm_core.fieldbus.described._device_file import (
    FORMATS,
    LONGEST_BITS,
    MOST_BITS,
    SCHEMA,
    Clock,
    DeviceDescription,
    Entry,
    Role,
)
from ocmm_core.fieldbus.described._process_image import ProcessImage
from ocmm_core.fieldbus.device import FRAMES_PER_CYCLE, N_SLOTS

_FOLDER = "devices"
_IN_ROLES = set(Role) - {Role.HEARTBEAT, Role.CONSTANT}
_OUT_ROLES = {Role.HEARTBEAT, Role.CONSTANT}
_OF_SPOTS = {Role.X, Role.Y, Role.INTENSITY}
_WHOLE = {Role.VALID, Role.COUNTER, Role.TIME, Role.BUTTON}
_SHORTEST_BITS = {Role.TIME: 32, Role.COUNTER: 8}
"""A bus time or counter with an earlier overflow proves no order."""
_LONG_NAME = 60
_SHORTEST_NS = 50_000
"""Between two exposures."""


def load_device(name: str, beside: Path | None = None) -> DeviceDescription:
    """Return the description with this name or path, such as ``"thesis-camera"``.

    Relative paths start at the folder of ``beside``, the document with the reference. InputError,
    with file and field, if it is missing or inconsistent.
    """
    if "/" in name or name.endswith(".toml"):
        path = Path(name)
        if not path.is_absolute() and beside is not None:
            path = beside.parent / path
    else:
        path = resource(_FOLDER, f"{name}.toml")
        if not path.is_file():
            known = sorted(each.stem for each in resource(_FOLDER).glob("*.toml"))
            raise InputError(
                "device.unknown",
                f"There is no camera description '{name}'.",
                f"Give one of {', '.join(known)}, or the path of a file.",
            )
    device = load_document(path, DeviceDescription, SCHEMA)
    _check(path, device)
    return device


def _check(path: Path, device: DeviceDescription) -> None:
    def refuse(field: str, what: str, remedy: str) -> InputError:
        return InputError("device.field", f"{path}: field '{field}' {what}.", remedy)

    numbers = (
        ("vendor", device.vendor, 1, 0xFFFFFFFF),
        ("product", device.product, 0, 0xFFFFFFFF),
        ("revisions", device.revisions[0], 0, device.revisions[1]),
        ("revisions", device.revisions[1], 0, 0xFFFFFFFF),
        ("slots", device.slots, 1, N_SLOTS),
        ("exposures", device.exposures, 1, FRAMES_PER_CYCLE),
        ("cycle_ns", device.cycle_ns, 250_000, 10_000_000),
        ("latency_ns", device.latency_ns, 0, 10_000_000),
        ("doubt_ns", device.doubt_ns, 0, 1_000_000_000),
    )
    for field, value, low, high in numbers:
        if not low <= value <= high:
            raise refuse(field, f"is {value}, but must be {low} to {high}", "Correct that field.")
    if not (math.isfinite(device.step) and 0.0 < device.step <= 1.0):
        raise refuse(
            "step", f"is {device.step}, but must be above 0 and at most 1 px or mm",
            "Give the pixels or millimetres that 1 on the wire stands for.",
        )  # fmt: skip
    if device.cycle_ns % device.exposures or device.period_ns < _SHORTEST_NS:
        raise refuse(
            "cycle_ns",
            f"is {device.cycle_ns}, which {device.exposures} exposures do not divide into whole "
            f"nanoseconds of {_SHORTEST_NS} at least",
            "Give a cycle that they divide.",
        )
    if not (0 < len(device.name) <= _LONG_NAME and device.name.isprintable()):
        raise refuse(
            "name", f"has {len(device.name)} characters, or some that cannot be printed",
            f"Give a name of 1 to {_LONG_NAME} characters.",
        )  # fmt: skip
    if device.clock is Clock.DISTRIBUTED and 2 * device.doubt_ns >= device.period_ns:
        raise refuse(
            "doubt_ns",
            f"is {device.doubt_ns}, but exposures of one clock are {device.period_ns} ns apart: "
            "from half of that on nobody knows which one it was",
            'Give the doubt of the clock, or clock = "arrival".',
        )
    if not 0.0 <= device.lens_doubt_px <= 1.0:
        raise refuse(
            "lens_doubt_px", f"is {device.lens_doubt_px}, but must be 0 to 1", "Correct that field."
        )
    for what, objects, roles in (
        ("inputs", device.inputs, _IN_ROLES),
        ("outputs", device.outputs, _OUT_ROLES),
    ):
        if not objects:
            raise refuse(
                what, "is empty",
                "Name the process data objects; without outputs a camera has no watchdog.",
            )  # fmt: skip
        device_places.check_objects(path, what, device)
        for pdo in objects:
            for entry in pdo.entries:
                _check_entry(path, what, entry, roles, device.slots)
    image = ProcessImage(device)
    _check_roles(path, device, image)
    _check_order(path, device, image)
    device_places.check_places(path, device, image)
    device_places.check_values(path, device)
    device_places.check_memory(path, device, image)


def _check_entry(path: Path, field: str, entry: Entry, roles: set[Role], n_slots: int) -> None:
    where = f"{path}: field '{field}', entry {entry.index:#06x}:{entry.sub:02x}"
    if not entry.is_gap:
        device_places.check_index(path, field, entry.index)
    elif entry.sub or entry.role != (Role.IGNORED,):
        raise InputError(
            "device.field",
            f"{where} has the index 0, which only pads, but a sub-index or a role.",
            "Give a gap sub = 0 and the role 'ignored', or correct the index.",
        )
    _check_width(where, entry)
    if entry.slot < -1 or entry.slot >= n_slots or (entry.slots and entry.slot >= 0):
        raise InputError(
            "device.field",
            f"{where} has slot = {entry.slot}, but the camera has the slots 0 to {n_slots - 1}, "
            "and slots = true means all of them.",
            "Give one slot, or slots = true.",
        )
    if not entry.role:
        raise InputError("device.field", f"{where} has no role.", "Say what it is, or 'ignored'.")
    for role in entry.role:
        if role not in roles and not entry.is_gap:
            raise InputError(
                "device.field",
                f"{where} has the role '{role}', which is none of {field}.",
                f"Give one of {', '.join(sorted(roles))}.",
            )
        if role in _OF_SPOTS and not entry.is_of_slots:
            raise InputError(
                "device.field",
                f"{where} is of a spot ('{role}') but not for each slot.",
                "Set slots = true.",
            )
        per_slot = role in _OF_SPOTS or role in (Role.VALID, Role.IGNORED)
        if entry.is_of_slots and not per_slot:
            raise InputError(
                "device.field",
                f"{where} is for each slot, but '{role}' is of all spots together.",
                "Set slots = false and slot = -1.",
            )
        if role is Role.VALID and not entry.is_of_slots and entry.width < n_slots:
            raise InputError(
                "device.field",
                f"{where} has {entry.width} bit(s) for {n_slots} slots.",
                "Give a bit for each slot, or one entry 'valid' for each slot.",
            )
        if (role in _WHOLE or role in _OUT_ROLES) and FORMATS[entry.type][1] == "f":
            raise InputError(
                "device.field",
                f"{where} is a {entry.type}, but '{role}' is a whole number.",
                "Give the type of a whole number.",
            )


def _check_width(where: str, entry: Entry) -> None:
    """Refuse lengths that do not suit the type."""
    whole = msgspec.structs.replace(entry, bits=0).width
    unused = all(role is Role.IGNORED for role in entry.role)
    raw = entry.type == "BITS"
    most = LONGEST_BITS if raw and unused else whole
    if FORMATS[entry.type][1] == "f" or entry.type == "BOOL":
        most = 0
    if not (1 if raw else 0) <= entry.bits <= most:
        raise InputError(
            "device.field",
            f"{where} is a {entry.type} with bits = {entry.bits}.",
            f"Give {'1' if raw else '0'} to {most}; BITS takes any length up to {MOST_BITS}, and "
            f"up to {LONGEST_BITS} if it is ignored.",
        )


def _check_roles(path: Path, device: DeviceDescription, image: ProcessImage) -> None:
    placed = [entry for _index, entries in image.inputs for entry in entries]
    per_slot = (Role.X, Role.Y, *((Role.VALID,) if image.is_of_slots(Role.VALID) else ()))
    for role in per_slot:
        found = sorted((one.exposure, one.slot) for one in placed if one.role is role)
        wanted = [(e, s) for e in range(device.exposures) for s in range(device.slots)]
        if found != wanted:
            raise InputError(
                "device.field",
                f"{path}: field 'inputs' has {len(found)} numbers '{role}', but {device.exposures} "
                f"exposure(s) of {device.slots} slot(s) need {len(wanted)}, each once.",
                "Map both coordinates, and 'valid' if it is of single slots, of every slot of "
                "every exposure.",
            )
    for role in (*_OF_SPOTS, Role.VALID):
        types = {f"{one.type} of {one.bits} bits" for one in placed if one.role is role}
        if len(types) > 1:
            raise InputError(
                "device.field",
                f"{path}: field 'inputs' has numbers '{role}' of the types "
                f"{' and '.join(sorted(types))}.",
                "Give all of them one type.",
            )
    if device.clock is Clock.ARRIVAL and not device.doubt_ns:
        raise InputError(
            "device.field",
            f"{path}: field 'doubt_ns' is 0, but a time that is known by arrival has a doubt.",
            "Give the longest time between exposure and arrival, less latency_ns.",
        )


def _check_order(path: Path, device: DeviceDescription, image: ProcessImage) -> None:
    """Refuse fields that seem to prove age or order but do not."""
    placed = [entry for _index, entries in image.inputs for entry in entries]
    for role in _WHOLE:
        places = [one.exposure for one in placed if one.role is role and one.slot < 0]
        if len(places) != len(set(places)) or (-1 in places and len(places) > 1):
            raise InputError(
                "device.field",
                f"{path}: field 'inputs' has more than one number '{role}'.",
                "Keep one, of all exposures together or of each; give the others 'ignored'.",
            )
    times = [one for one in placed if one.role is Role.TIME]
    if times and device.clock is Clock.ARRIVAL:
        raise InputError(
            "device.field",
            f"{path}: field 'inputs' has a number 'time', but a camera with a clock of its own "
            "exposes at no time of the bus clock.",
            "Give it the role 'ignored', or clock = \"distributed\".",
        )
    for role, least in _SHORTEST_BITS.items():
        shortest = min((one.bits for one in placed if one.role is role), default=least)
        if shortest < least:
            raise InputError(
                "device.field",
                f"{path}: field 'inputs' has a number '{role}' of {shortest} bits, but it takes "
                f"{least} at least to tell the cycles apart.",
                "Give it the role 'ignored'.",
            )
