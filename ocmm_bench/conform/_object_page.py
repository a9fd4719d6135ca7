"""Page about the camera's objects, and the command that writes it.

``python -m ocmm_bench.conform._object_page`` writes both from the object tables.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from ocmm_bench.conform._page_of_the_wire import CATEGORIES, MAILBOXES, SII_WORDS, STATES, WIRE
from ocmm_core.documents import resource, write_atomic
from ocmm_core.fieldbus.device import (
    DEVICE_NAME,
    ERROR_TEXTS,
    FRAME_DTYPE,
    FRAME_PDOS,
    FRAMES_PER_CYCLE,
    HEADER_PDO,
    HEADER_STRUCT,
    INPUT_DTYPE,
    MAILBOX_BYTES,
    MESSAGE_BYTES,
    N_SLOTS,
    OUTPUT_PDO,
    PRODUCT_CODE,
    REVISION,
    SYNC_MANAGERS,
    VENDOR_ID,
    CameraConfig,
    CameraMode,
    CameraStatus,
    Control,
    DictionaryObject,
    ErrorRegister,
    ObjectEntry,
    Pdo,
    configuration_values,
    object_dictionary,
)
from ocmm_sim.slave import CONTROLLERS, ESI_FILE, SYNC_PULSE_NS, esi_document, type_name

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
_HEAD = f"""\
# Objects of the {DEVICE_NAME}

This page is generated from the table in `ocmm_core/fieldbus/device` by
`python -m ocmm_bench.conform._object_page`, together with
`resources/ethercat/{ESI_FILE[1]}`.
Change the table, not this page.

The camera is an EtherCAT slave with CoE mailbox (ETG.1000), modular device profile (ETG.5001),
diagnosis history (ETG.1020) and distributed clock. Vendor {VENDOR_ID:#010x} (not assigned by the
ETG: it marks that the device is not a product), product {PRODUCT_CODE:#010x}, revision
{REVISION:#010x}. A master tells cameras apart by serial number (0x1018:04, and word 0x0E of the
EEPROM) and station alias (word 0x04); both must be unique. All numbers are little-endian.
"""
_FLOW = f"""\
## Frames, acknowledgement, go-back-N

A cycle carries up to {FRAMES_PER_CYCLE} frames (`frames_valid`), the first one with number
`counter` (exposure k has the number k modulo 2^32), exposed at `start_ns`; frame i of the block
was exposed at `start_ns + i * period_ns`. Times are those of the bus clock. With DC, exposure k
happens at SYNC0 start + k * SYNC0 period, so that the same number means the same moment in all
cameras. Frames behind `frames_valid` are old and must not be looked at.

The camera keeps every frame until the master acknowledges it: `ack_counter` is the number of the
last frame that the master has, valid while bit 0 of `control` is set. The next block begins with
the first frame that is not acknowledged. So a cycle that is lost or refused is simply not
acknowledged, and its frames come again. An acknowledgement of a frame that was not in the last
block is ignored. A buffer that runs over drops the oldest frames, sets status bit 2 and bit 1 in
the flags of the first frame behind the gap, and counts in 0xA000:01.

A master must check, before it uses a block: working counter, AL state, `data_crc`, that
`cycle_counter` advanced, `boot_counter`, `config_crc`, and that `start_ns` and `counter` fit.
`data_crc` is the CRC-32 (ISO 3309, as in zlib) of the serial number (4 bytes) and then all
{INPUT_DTYPE.itemsize} input bytes with `data_crc` itself as zero. So an input that reaches the
place of another camera is known as not its own. `cycle_counter` goes on by one at each renewal;
where it went on by more than half of its range it has gone back. What only the firmware can do
wrong (a changed input with its check sum; counter and time of another exposure) no master can see.

Cameras of revision 0x00020000 are still read: byte 17 is their `cycle_counter` (8 bits), bytes 18
and 19 their status, and the check sum is that of the input alone. Swapped inputs of two such
cameras, and inputs 57 to 199 cycles old, look like good ones.

`config_crc` is CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF) of the values of 0x8000:01 to
:05 and then 0x8001:01 to :{4 * N_SLOTS:02X}, in this order and with their own lengths
({sum(len(value) for _index, _sub, value in configuration_values(CameraConfig()))} bytes).

In mode {CameraMode.RAW} (raw) x and y are pixels in steps of 2^-16; in mode
{CameraMode.CORRECTED} (corrected) they are ideal image points in mm in steps of 2^-24, origin at
the principal point, with the lens of the stored intrinsics taken out. The measuring program uses
raw spots only.
"""
_COMMANDS = """\
## Commands

Black image: write the number of exposures to 0x8020:02, then 1 to :01; wait until :03 is no longer
1 (busy). All spots are invalid meanwhile. 2 keeps it without power, 3 takes the kept one into use,
4 drops both. A command while another one runs is refused with 0x08000021.

Snapshot: write the region to 0x8030:01 to :04 (zero width or height: the whole sensor), then 1 to
:05; wait until :06 is 2 (done). Then, until the total of :08 is there: write the offset to :09 and
read a chunk from :0A. Compare the CRC-32 of all bytes with :0B, and write 2 to :05.

Identify: write the seconds to 0x8040:01; the status light blinks twice a second for so long.

Intrinsics: write the block to 0x8010:01, read it back, and compare SHA-256 (:03). The camera
refuses a damaged block and one of another serial number. The block (100 bytes): letters `OCIN`,
version UINT 1, reserved UINT 0, serial number UDINT, date ULINT (s since 1970 UTC), width and
height UINT (px), then nine 64-bit floats: pixel pitch mm, focal length mm, aspect, u0 px, v0 px,
k1 mm^-2, k2 mm^-4, p1 mm^-1, p2 mm^-1; at the end the CRC-32 of all before.
"""
_ERRORS = f"""\
## Errors

An error is an emergency message (CoE service 1: code UINT, error register USINT, five bytes), an
entry of 0x10F3 and bits of 0x1001. Code 0x0000 says that an error is over. A message of 0x10F3
({MESSAGE_BYTES} bytes) holds 0xE800 UINT, error code UINT, flags UINT (0x0202 error, 0x0200 end),
text UINT (the error code), bus time ULINT, 0x0005 UINT, error register USINT, 0x1005 UINT and
five bytes.

Over temperature carries the temperature as INT, 0.1 degC, in its first two bytes.

A camera that is told to start with a configuration that contradicts itself (exposure not shorter
than the period, a window that is not on the sensor, mode corrected without intrinsics) falls to
PREOP with AL status code 0x0026.

Refusals of SDO transfers use the abort codes of ETG.1000.6: 0x05030000 toggle bit, 0x05040001
command, 0x06010002 read only, 0x06010004 no complete access (only records of whole numbers travel
as a whole), 0x06020000 no object, 0x06090011 no entry, 0x06070010 length, 0x06090030 value,
0x06090031 too high, 0x06090032 too low, 0x08000020 not stored, 0x08000021 busy, 0x08000022 wrong
state, 0x08000024 no data. A mailbox that is no CoE mailbox gets a mailbox error reply (ETG.1000.4).
"""


def object_page() -> str:
    """Return the page as Markdown."""
    return "\n".join(
        (
            _HEAD,
            _process_data(),
            _eeprom(),
            _FLOW,
            _COMMANDS,
            STATES,
            MAILBOXES,
            WIRE,
            _ERRORS,
            _table(("Code", "Meaning"), ((f"{c:#06x}", text) for c, text in ERROR_TEXTS.items())),
            "Error register (0x1001):\n",
            _bits(_REGISTER),
            "## Objects\n",
            "Access: `ro` read only, `rw` may be written, `rw in PREOP` only while no frames are\n"
            "made. Entry 0 of a record holds the number of its last entry.\n",
            *(_object(index, item) for index, item in object_dictionary(serial=0).items()),
        )
    )


def write_files() -> None:
    esi = resource(*ESI_FILE)
    esi.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(esi, esi_document())
    write_atomic(PAGE, object_page().encode())


def _process_data() -> str:
    managers = (
        (str(number), name, f"{start:#06x}", str(size))
        for number, (name, (start, size, *_rest)) in enumerate(
            zip(("mailbox out", "mailbox in", "outputs", "inputs"), SYNC_MANAGERS, strict=True)
        )
    )
    return "\n".join(
        (
            "## Process data\n",
            _table(("Sync manager", "For", "Start", "Bytes"), managers),
            f"A mailbox has {MAILBOX_BYTES} bytes. Inputs: the header of {HEADER_STRUCT.size} "
            f"bytes, then {FRAMES_PER_CYCLE} frames\nof {FRAME_DTYPE.itemsize} bytes each.\n",
            f"Header ({HEADER_PDO.index:#06x}):\n",
            _layout(HEADER_PDO),
            f"Frame k ({FRAME_PDOS[0].index:#06x} + k, objects "
            f"{FRAME_PDOS[0].entries[0].index:#06x} + 0x10 k):\n",
            _layout(FRAME_PDOS[0]),
            f"Outputs ({OUTPUT_PDO.index:#06x}):\n",
            _layout(OUTPUT_PDO),
            "Status:\n",
            _bits(_STATUS),
            "Flags of a frame: bit 0 the button of the probe is pressed, bit 1 frames were lost\n"
            "just before this one, bit 2 a spot is overexposed, bit 3 the probe felt a blow; it\n"
            "stays set for a second, so that a cycle that is lost does not hide it.\n",
            f"Control: bit {Control.STREAM.bit_length() - 1} the acknowledgement is valid.\n",
        )
    )


def _eeprom() -> str:
    rows = (
        (
            item.controller, f"{item.pdi_control:#06x}", f"{item.pdi_configuration:#06x}",
            f"{SYNC_PULSE_NS // 10:#06x}", f"`{item.content.hex(' ', 2).upper()}`",
        )
        for item in CONTROLLERS
    )  # fmt: skip
    return "\n".join(
        (
            "## EEPROM\n",
            "Words 0 to 6 are loaded at power-on: connection of the processor and units of the\n"
            "clock (0x0140), pins (0x0150), length of a pulse (0x0982, in 10 ns). Without word 1\n"
            "an ET1100 makes SYNC0 an input, and without bit 10 of word 0 it gives none out. The\n"
            "file has the words of the first row; with another controller take those of its row.\n",
            _table(("Controller", "Word 0", "Word 1", "Word 2", "ConfigData"), rows),
            "All words (ETG.2010):\n",
            _table(("Word", "Content"), SII_WORDS),
            CATEGORIES,
        )
    )


def _layout(pdo: Pdo) -> str:
    rows, at = [], 0
    for entry in pdo.entries:
        rows.append((str(at), entry.name, entry.kind.name, entry.unit, entry.text))
        at += entry.bits // 8
    return _table(("Byte", "Name", "Type", "Unit", "Meaning"), rows)


def _bits(meanings: dict[CameraStatus, str] | dict[ErrorRegister, str]) -> str:
    rows = ((str(flag.bit_length() - 1), text) for flag, text in meanings.items())
    return _table(("Bit", "Meaning"), rows)


def _object(index: int, item: DictionaryObject) -> str:
    lines = [f"### 0x{index:04X} {item.name}\n"]
    if item.record and item.text:
        lines.append(f"{item.text}\n")
    if index in range(FRAME_PDOS[1].index, FRAME_PDOS[-1].index + 1):
        lines.append(f"As {FRAME_PDOS[0].index:#06x}, for the objects of this frame.\n")
    elif index in range(FRAME_PDOS[1].entries[0].index, FRAME_PDOS[-1].entries[0].index + 1):
        lines.append(f"As {FRAME_PDOS[0].entries[0].index:#06x}.\n")
    else:
        rows = (_row(sub, entry) for sub, entry in item.entries.items() if sub or not item.record)
        titles = ("Entry", "Name", "Type", "Access", "Unit", "Default", "Meaning")
        lines.append(_table(titles, rows))
    return "\n".join(lines)


def _row(sub: int, entry: ObjectEntry) -> tuple[str, ...]:
    meaning = entry.text
    if entry.writable and entry.is_number and entry.high is not None:
        low = 0 if entry.low is None else entry.low
        meaning = f"{meaning} {low} to {entry.high}.".strip()
    if entry.mapped:
        meaning = f"{meaning} Process data.".strip()
    return (
        f"{sub:02X}", entry.name, type_name(entry), entry.access.value, entry.unit,
        _default(entry), meaning,
    )  # fmt: skip


def _default(entry: ObjectEntry) -> str:
    if entry.live or not entry.value:
        return ""
    if not entry.is_number:
        return entry.value.decode("ascii")
    value = entry.number(entry.value)
    return f"{value:#x}" if value > 0xFFFF and not entry.unit else str(value)


def _table(titles: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [titles, ("---",) * len(titles), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


if __name__ == "__main__":
    write_files()
    sys.stdout.write(f"{resource(*ESI_FILE)}\n{PAGE}\n")
