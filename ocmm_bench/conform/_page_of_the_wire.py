"""Sections of the object page on the wire and the protocol.

Words, deadlines and limits; states, mailboxes and EEPROM, each tested by `ocmm camera conform`.
"""

from ocmm_core.fieldbus.device import (
    DEFAULT_FRAME_PERIOD_NS,
    DEVICE_NAME,
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    MAILBOX_OUT_START,
    PRODUCT_CODE,
    REVISION,
    SYNC0_NS,
    SYNC1_NS,
    SYNC_MANAGERS,
    VENDOR_ID,
)
from ocmm_sim.slave import (
    CLOCK_MODES,
    DEVICE_GROUP,
    MAILBOX_REPEATS,
    MEMORY_END,
    PHYSICAL_PORTS,
    SII_BYTES,
    SYNC_PULSE_NS,
)

SII_WORDS = (
    ("0x00 to 0x02", "Connection, pins and pulse of the controller: the next table."),
    ("0x03", "0 (further connection)."),
    ("0x04", "Station alias; loaded at power-on into register 0x0012."),
    ("0x05 to 0x06", "0."),
    ("0x07", "Low byte: CRC-8 (polynomial 0x07, start 0xFF) of words 0 to 6; high byte 0."),
    ("0x08 to 0x09", f"Vendor, {VENDOR_ID:#010x}."),
    ("0x0A to 0x0B", f"Product, {PRODUCT_CODE:#010x}."),
    ("0x0C to 0x0D", f"Revision, {REVISION:#010x}."),
    ("0x0E to 0x0F", "Serial number: the same as 0x1018:04, or the camera is refused."),
    ("0x10 to 0x13", "0."),
    ("0x14 to 0x17", f"Mailboxes in BOOT: {MAILBOX_OUT_START:#06x}, {MAILBOX_BYTES}, "
                     f"{MAILBOX_IN_START:#06x}, {MAILBOX_BYTES}."),
    ("0x18 to 0x1B", "Mailboxes in the other states: the same."),
    ("0x1C", "Protocols: 0x000C, CoE and FoE."),
    ("0x3E", f"Size: {SII_BYTES * 8 // 1024 - 1} (kbit less one)."),
    ("0x3F", "Version: 1."),
    ("from 0x40", "Categories: strings (10), general (30), FMMU (40: outputs, inputs), sync "
                  "managers (41), 13 TxPDO (50), RxPDO (51), clock (60); 0xFFFF at the end."),
)  # fmt: skip

WIRE = f"""\
## Controller: FMMUs, watchdog, clock signals

At least two FMMUs: one writes the outputs, one reads the inputs, whole bytes each. A master may use
a third for the state of the mailbox; the camera needs none.

Watchdog of the outputs: divider 0x0400 is 2498 and time 0x0420 is 1000 at power-on, so that 100 ms
without outputs end OP: SAFEOP with AL status code 0x001B, emergency 0x8130, one more in 0x0442 and
0xA000:02. The exposures go on, and no frame is lost that the buffer (1024 frames) can hold.

SYNC0 (every {SYNC0_NS} ns by default) begins an exposure. SYNC1 comes {SYNC1_NS} ns after the last
SYNC0 of a bus cycle; the camera needs it for nothing, and a master may leave it out. A pulse is
{SYNC_PULSE_NS} ns long. A period below 50000 ns is refused with AL status code 0x0030.

Latch time: a frame is readable one period after its exposure began. Inputs are put together when
the master reads them, or on an event just before; the master reads 100 us after the last exposure
of a block has ended, and what is not ready then comes with the next cycle.

## Deadlines and limits of the master

| What | Limit |
| --- | --- |
| Answer to an SDO request while the bus is brought up | 80 ms, asked twice |
| Progress of an SDO transfer in operation | 500 ms, begun again up to four times |
| Change of state in a bring-up | 1 s |
| Way back from SAFEOP to OP | 500 ms, then everything begins anew |
| Answer to the request to write a file (a bank is erased) | 10 s |
| Answer to a packet of a file | 2 s |
| Change of state to and from BOOT | 5 s |
| Answer to a process data frame | 70 % of the bus cycle |
| First exposure after it was programmed | 60 ms |

Clock: before SAFEOP, register 0x092C of each camera must be below 1 us in 20 readings in a row,
within 3 s. In operation more than 20 us refuse the cycle, and the exposures begin anew. A reference
clock that drifts by more than 500 ppm against the computer is told. The first camera of the wire is
the reference; its clock has to count 64 bits.

Ring: with a redundancy cable frames come in at port 0 and at the last port. The processing unit
follows port 0: what comes in at port 1 passes unchanged. A port without link closes its loop, which
the controller does by itself; the firmware needs to do nothing.

## BOOT and firmware

INIT to BOOT with the mailboxes of words 0x14 to 0x17; from BOOT only back to INIT. In BOOT there is
FoE and no CoE. A file named `firmware` is written, none is read. Whole packets have
{MAILBOX_BYTES - 12} bytes; a shorter one, and be it empty, is the last. A packet that comes again
is acknowledged again. A camera that is busy (operation 6) gets the same packet again after 50 ms,
for 10 s at most. Errors: 0x8001 no such file, 0x8002 reading, 0x8003 too large, 0x8004 not in
BOOT, 0x8005 packet number, 0x8009 not for this camera or not signed by its maker.

The file: letters `OCFW`, version UINT 1, bytes of the version text UINT, product UDINT, lowest and
highest revision UDINT each, bytes of the content UDINT, SHA-256 of the content, version text
(1 to 60 printable ASCII characters), content, and an Ed25519 signature (64 bytes) over all before
it, which the camera checks with the key of its maker.

It is written into the bank that does not run. One record with its own check sum then names that
bank; leaving BOOT starts it on trial. Reaching PREOP confirms it; 0x100A is then its version text,
which the master compares. Switched off before PREOP, the camera starts the old one again. So a loss
of power at any moment leaves a camera that starts.

With exposures every {DEFAULT_FRAME_PERIOD_NS} ns nothing of this disturbs measuring: it needs a bus
that is not in operation.
"""


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
