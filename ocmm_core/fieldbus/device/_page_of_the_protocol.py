"""Sections of the object page on states, mailboxes, EEPROM; `ocmm camera conform` tests each."""

from __future__ import annotations

from ocmm_core.fieldbus.device._camera_slave import DEVICE_NAME, SYNC_MANAGERS
from ocmm_core.fieldbus.device._controller import (
    CLOCK_MODES,
    DEVICE_GROUP,
    MAILBOX_REPEATS,
    MEMORY_END,
    PHYSICAL_PORTS,
)

_MANAGERS = ", ".join(
    f"{start:#06x} {size} {control:#04x} {active} {kind}"
    for start, size, control, _status, active, kind in SYNC_MANAGERS
)
_CLOCK = "; ".join(
    f"`{mode.name}` with activation {mode.activate:#06x}, factors {mode.sync0_factor} and "
    f'{mode.sync1_factor}, "{mode.text}"'
    for mode in CLOCK_MODES
)

CATEGORIES = f"""\
The memory has to reach to {MEMORY_END:#06x}, because process data have three buffers one behind
another: 8 kB from 0x1000 on suffice, an ET1200 (1 kB) and controllers with 4 kB do not. Another
controller needs the same of its own registers: SYNC0 and SYNC1 given out, push-pull and active
high, both as interrupts, and the length of the pulse.

Categories. General: group `{DEVICE_GROUP}` (bytes 0 and 14), name `{DEVICE_NAME}` (byte 3 and, as
order number, byte 2), CoE details 0x23 (byte 5: SDO, SDO information, complete access), FoE 1
(byte 6), flags {MAILBOX_REPEATS:#04x} (byte 11: mailboxes are sent again), ports
{PHYSICAL_PORTS:#06x} (UINT at byte 16). FMMU: 1, 2. Sync managers, each start, bytes, control,
status 0, activation and type: {_MANAGERS}.
TxPDO: the header (0x1A00) and the frames in order, sync manager 3; RxPDO 0x1600, sync manager 2;
each with its name and the flags 0x0011 (fixed, mandatory); their entries with name, type and bits
as the tables of the process data say. Clock, 24 bytes a mode, activation at byte 14, factors of
SYNC0 (INT at byte 16) and SYNC1 (INT at byte 12) by the bus cycle, name (byte 18) and text (byte
19): {_CLOCK}.
"""

STATES = """\
## States

Every change is asked for in 0x0120 and shown in 0x0130; 0x0134 holds the AL status code, 0 while
there is no error. What is refused leaves the camera where it is, with the error bit (0x10). While
that is set, a request for the same or a higher state without the acknowledge bit (0x10) is ignored.

| From | To | Needs | Otherwise |
| --- | --- | --- | --- |
| INIT | PREOP | sync managers 0 and 1, start and bytes as above, active | 0x0016 |
| PREOP | SAFEOP | sync manager 2 likewise | 0x001D |
| PREOP | SAFEOP | sync manager 3 likewise | 0x001E |
| PREOP | SAFEOP | SYNC0, where it is active, every 50000 ns or more | 0x0030 |
| PREOP | SAFEOP | a configuration that does not contradict itself: the camera falls back | 0x0026 |
| SAFEOP | OP | nothing more | |
| INIT | BOOT | sync managers 0 and 1 | 0x0015 |
| any | the same or a lower one | nothing; from BOOT only INIT | 0x0011 |
| any | BOOT, SAFEOP or OP by another way | | 0x0011 |
| any | a number that is no state | | 0x0012 |

Process data are exchanged from SAFEOP on; outputs count 2 in LRW, inputs 1. Exposures begin with
SAFEOP where SYNC0 is active, or else with OP, and end below SAFEOP. Each start begins with exposure
0: at the SYNC0 start that was programmed, not before.
"""

MAILBOXES = """\
## Mailboxes

The counter in the head of an answer runs from 1 to 7 and begins again. A mailbox that nobody has
fetched stays; where the master turns bit 1 of 0x080E, the last one is sent again and bit 1 of
0x080F follows. Error replies (protocol 0: type UINT 1, detail UINT) count in 0xA000:04: detail 2
unknown protocol, 4 unknown CoE service, 6 too short, 8 longer than the mailbox. An abort of the
master is not answered. SDO information (lists, object and entry descriptions) tells everything on
this page. Segments may have any length that fits into the mailbox.

A record that is written as a whole is kept wholly or not at all. 0x10F3:03 takes entries that hold
a message, or 0; anything else is 0x06090030. Messages stand in entries 6 to 21 in turn; the error
of the watchdog sets bits 0 and 4 of the error register, and the change to OP ends it.

Black image: 2 and 3 without an image are 0x08000024. Snapshot: a region that is not on the sensor
is 0x06090030; a chunk before the picture is done, or behind its end, 0x08000024. Intrinsics: a
damaged block and a foreign one are 0x06090030, no bytes take it away; mode 1 without them is
0x08000024. FoE: a packet that no request to write went before is 0x8004. Leaving BOOT is a start:
leaving it twice without PREOP in between ends a trial.
"""
