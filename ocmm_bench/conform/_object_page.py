"""Page about the camera's objects, and the command that writes it.

``python -m ocmm_bench.conform._object_page`` writes both from the object tables.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from ocmm_core.documents import read_text, resource, write_atomic
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.device import CameraStatus, ErrorRegister
from ocmm_sim import slave

PAGE = Path(__file__).resolve().parents[2] / "docs" / "integrator" / "camera_objects.md"

_STATUS = {
    CameraStatus.OPERATIONAL: "in OP, outputs arrive in time",
    CameraStatus.SYNCHRONISED: "SYNC0 starts the exposures",
    CameraStatus.OVERRUN: "frames were lost just before the first one of this block",
    CameraStatus.DARK: "a frame was exposed without light (black image), or the sensor failed",
    CameraStatus.DIAGNOSIS: "a message in 0x10F3 is not acknowledged",
}
_REGISTER = {
    ErrorRegister.GENERIC: "any error",
    ErrorRegister.TEMPERATURE: "temperature",
    ErrorRegister.COMMUNICATION: "communication",
    ErrorRegister.PROFILE: "sensor",
    ErrorRegister.MANUFACTURER: "reserved",
}


def object_page() -> str:
    """Return the page as Markdown: `resources/ethercat/camera_objects.md` with its values."""
    values = {
        name: getattr(module, name)
        for module in (device, slave)
        for name in module.__all__
        if name.isupper()
    }
    clock = "; ".join(
        f"`{mode.name}` with activation {mode.activate:#06x}, factors {mode.sync0_factor} and "
        f'{mode.sync1_factor}, "{mode.text}"'
        for mode in slave.CLOCK_MODES
    )
    managers = ", ".join(
        f"{start:#06x} {size} {control:#04x} {active} {kind}"
        for start, size, control, _status, active, kind in device.SYNC_MANAGERS
    )
    frame = device.FRAME_PDOS[0]
    configuration = device.configuration_values(device.CameraConfig())
    errors = ((f"{code:#06x}", text) for code, text in device.ERROR_TEXTS.items())
    objects = (_object(*one) for one in device.object_dictionary(serial=0).items())
    template = read_text(resource("ethercat", "camera_objects.md"))
    return template.format(
        **values, esi=slave.ESI_FILE[1], managers=managers, clock=clock,
        packet=device.MAILBOX_BYTES - 12, kbit_less_one=slave.SII_BYTES * 8 // 1024 - 1,
        inputs=device.INPUT_DTYPE.itemsize, header_bytes=device.HEADER_STRUCT.size,
        frame_bytes=device.FRAME_DTYPE.itemsize, last_window=4 * device.N_SLOTS,
        configuration=sum(len(value) for _index, _sub, value in configuration),
        raw=device.CameraMode.RAW, corrected=device.CameraMode.CORRECTED,
        header_pdo=device.HEADER_PDO.index, output_pdo=device.OUTPUT_PDO.index,
        frame_pdo=frame.index, frame_object=frame.entries[0].index,
        header=_layout(device.HEADER_PDO), frame=_layout(frame),
        outputs=_layout(device.OUTPUT_PDO),
        sync_managers=_managers(), controllers=_controllers(),
        status=_bits(_STATUS), register=_bits(_REGISTER),
        stream_bit=device.Control.STREAM.bit_length() - 1,
        errors=_table(("Code", "Meaning"), errors),
        objects="\n\n".join(objects),
    )  # fmt: skip


def write_files() -> None:
    esi = resource(*slave.ESI_FILE)
    esi.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(esi, slave.esi_document())
    write_atomic(PAGE, object_page().encode())


def _managers() -> str:
    names = ("mailbox out", "mailbox in", "outputs", "inputs")
    rows = (
        (str(number), name, f"{start:#06x}", str(size))
        for number, (name, (start, size, *_rest)) in enumerate(
            zip(names, device.SYNC_MANAGERS, strict=True)
        )
    )
    return _table(("Sync manager", "For", "Start", "Bytes"), rows)


def _controllers() -> str:
    rows = (
        (
            item.controller, f"{item.pdi_control:#06x}", f"{item.pdi_configuration:#06x}",
            f"{slave.SYNC_PULSE_NS // 10:#06x}", f"`{item.content.hex(' ', 2).upper()}`",
        )
        for item in slave.CONTROLLERS
    )  # fmt: skip
    return _table(("Controller", "Word 0", "Word 1", "Word 2", "ConfigData"), rows)


def _layout(pdo: device.Pdo) -> str:
    rows, at = [], 0
    for entry in pdo.entries:
        rows.append((str(at), entry.name, entry.kind.name, entry.unit, entry.text))
        at += entry.bits // 8
    return _table(("Byte", "Name", "Type", "Unit", "Meaning"), rows)


def _bits(meanings: dict[CameraStatus, str] | dict[ErrorRegister, str]) -> str:
    rows = ((str(flag.bit_length() - 1), text) for flag, text in meanings.items())
    return _table(("Bit", "Meaning"), rows)


def _object(index: int, item: device.DictionaryObject) -> str:
    lines = [f"### 0x{index:04X} {item.name}\n"]
    if item.record and item.text:
        lines.append(f"{item.text}\n")
    if index in range(device.FRAME_PDOS[1].index, device.FRAME_PDOS[-1].index + 1):
        lines.append(f"As {device.FRAME_PDOS[0].index:#06x}, for the objects of this frame.")
    elif index in range(
        device.FRAME_PDOS[1].entries[0].index, device.FRAME_PDOS[-1].entries[0].index + 1
    ):
        lines.append(f"As {device.FRAME_PDOS[0].entries[0].index:#06x}.")
    else:
        rows = (_row(sub, entry) for sub, entry in item.entries.items() if sub or not item.record)
        titles = ("Entry", "Name", "Type", "Access", "Unit", "Default", "Meaning")
        lines.append(_table(titles, rows))
    return "\n".join(lines)


def _row(sub: int, entry: device.ObjectEntry) -> tuple[str, ...]:
    meaning = entry.text
    if entry.writable and entry.is_number and entry.high is not None:
        low = 0 if entry.low is None else entry.low
        meaning = f"{meaning} {low} to {entry.high}.".strip()
    if entry.mapped:
        meaning = f"{meaning} Process data.".strip()
    return (
        f"{sub:02X}", entry.name, slave.type_name(entry), entry.access.value, entry.unit,
        _default(entry), meaning,
    )  # fmt: skip


def _default(entry: device.ObjectEntry) -> str:
    if entry.live or not entry.value:
        return ""
    if not entry.is_number:
        return entry.value.decode("ascii")
    value = entry.number(entry.value)
    return f"{value:#x}" if value > 0xFFFF and not entry.unit else str(value)


def _table(titles: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [titles, ("---",) * len(titles), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


if __name__ == "__main__":
    write_files()
    sys.stdout.write(f"{resource(*slave.ESI_FILE)}\n{PAGE}\n")
