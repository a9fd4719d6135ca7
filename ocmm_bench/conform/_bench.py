"""Camera under test on its line: registers, states and cycles, with times; rules on it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ocmm_bench.conform._findings import NotAsDescribedError, RuleFindings
from ocmm_bench.conform._mail_line import (
    BOOT,
    BOOT_LIMIT_NS,
    ERROR,
    FIRST_LIMIT_NS,
    INIT,
    MS,
    NAMES,
    OP,
    PREOP,
    SAFEOP,
    STATE_LIMIT_NS,
    STATE_TIME,
    ConformLine,
    ExchangeCycle,
    MailLine,
    Status,
)
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.wire import Command, Datagram, read_words
from ocmm_sim.slave import SII_BYTES

_AL_CONTROL, _AL_STATUS = 0x0120, 0x0130
_SM, _FMMU, _SYNC = 0x0800, 0x0600, 0x0980
_LOGICAL = 0x0001_0000
_SYSTEM_TIME, _SYNC0_START, _SYNC0_CYCLE = 0x0910, 0x0990, 0x09A0
_POLL_S = 0.0005
_BEGIN_NS = 5 * MS
"""Delay of the first exposure after programming."""
_FULL = 0x08


class Bench:
    """A camera under test; `firmware` is signed by the maker, empty skips updates."""

    def __init__(self, line: ConformLine, place: int, firmware: bytes = b"") -> None:
        self.line = line
        self.firmware = firmware
        self.findings = RuleFindings({})
        self.serial = 0
        self.sync0_start = 0
        self.place = place
        self._eeprom = b""
        self._target = -place & 0xFFFF
        self.feeding = False
        """Exchange process data during every wait."""
        self._seen: int | None = None
        self._heartbeat = 0
        self.mail = MailLine(line, self.get, self.put, self.exchange, self._timed)

    def _timed(self, name: str, time_ns: int, limit_ns: int) -> None:
        self.findings.timed(name, time_ns, limit_ns)

    @property
    def objects(self) -> dict[int, device.DictionaryObject]:
        """Return the required object dictionary of the camera."""
        return device.object_dictionary(self.serial)

    # Registers

    def get(self, register: int, size: int) -> bytes:
        """Read memory of the camera; raise NotAsDescribedError if it does not answer."""
        answer = self._one(Datagram(Command.APRD, self._target, register, bytes(size)))
        if answer.working_counter != 1:
            raise NotAsDescribedError(
                f"Register {register:#06x} is not answered (working counter "
                f"{answer.working_counter})."
            )
        return answer.data

    def number(self, register: int, size: int = 2) -> int:
        """Read an unsigned little-endian number."""
        return int.from_bytes(self.get(register, size), "little")

    def put(self, register: int, content: bytes) -> int:
        """Write memory of the camera; return the working counter."""
        return self._one(Datagram(Command.APWR, self._target, register, content)).working_counter

    def exchange_one(self, datagram: Datagram) -> Datagram:
        """Send one datagram; used by the EEPROM readers."""
        return self._one(datagram)

    def system_ns(self) -> int:
        return self.number(_SYSTEM_TIME, 8)

    def eeprom(self) -> bytes:
        """Return the EEPROM, read at the first call."""
        if not self._eeprom:
            self._eeprom = read_words(self._one, self.place, 0, SII_BYTES // 2)
        return self._eeprom

    # States

    def status(self) -> Status:
        content = self.get(_AL_STATUS, 6)
        return Status(content[0] & 0x1F, int.from_bytes(content[4:6], "little"))

    def ask_state(
        self, wanted: int, *, acknowledge: bool = False, settle_s: float = 0.05
    ) -> Status:
        """Request a state; return the status once it is reached or refused."""
        before = self.line.now_ns()
        self.put(_AL_CONTROL, bytes([wanted | (ERROR if acknowledge else 0), 0]))
        limit = STATE_LIMIT_NS if BOOT not in (wanted, self.status().state) else BOOT_LIMIT_NS
        while True:
            status = self.status()
            passed = self.line.now_ns() - before
            if status.state == wanted:
                self.findings.timed(STATE_TIME, passed, STATE_LIMIT_NS)
                return status
            if status.state & ERROR and passed > settle_s * 1e9:
                return status
            if passed > limit:
                return status
            self.line.sleep(_POLL_S)

    def go(self, wanted: int) -> None:
        """Bring the camera from any state to the given one, as a master does."""
        self.feeding, self._seen = False, None
        status = self.status()
        if status.state & ERROR or status.state == BOOT or status.state > wanted:
            down = wanted in (INIT, PREOP, SAFEOP) and status.state & 0x0F > wanted
            self._must(wanted if down and status.state & 0x0F != BOOT else INIT)
        if wanted == BOOT:
            # PREOP would confirm firmware on trial.
            self._must(INIT)
            self.prepare(PREOP)
            self._must(BOOT)
            return
        for each in (PREOP, SAFEOP, OP):
            if self.status().state < each <= wanted:
                self.prepare(each)
                self._must(each)

    def again(self, wanted: int) -> None:
        """Bring the camera to INIT, then to a state, rewriting all registers."""
        self.go(INIT)
        self.go(wanted)

    def prepare(
        self, state: int, *, sync0_ns: int = device.SYNC0_NS, without: Sequence[int] = ()
    ) -> None:
        """Write the registers for a state; `sync0_ns` 0 leaves SYNC0 off."""
        for number in {PREOP: (0, 1), SAFEOP: (2, 3)}.get(state, ()):
            start, size, control, _status, _active, _kind = device.SYNC_MANAGERS[number]
            self.set_manager(number, start, size, control, 0 if number in without else 1)
        if state == SAFEOP:
            self._map(0, _LOGICAL, device.OUTPUT_START, device.OUTPUT_STRUCT.size, 2)
            self._map(
                1,
                _LOGICAL + device.OUTPUT_STRUCT.size,
                device.INPUT_START,
                device.INPUT_DTYPE.itemsize,
                1,
            )
            self.program_clock(sync0_ns)
        if state == OP:
            self.cycle()

    def set_manager(self, number: int, start: int, size: int, control: int, active: int) -> None:
        self.put(_SM + 8 * number, struct.pack("<HHBBBB", start, size, control, 0, active, 0))

    def program_clock(self, sync0_ns: int, begin_ns: int = _BEGIN_NS) -> None:
        """Program SYNC0 to start soon; a period of 0 switches it off."""
        self.put(_SYNC, bytes(2))
        if sync0_ns:
            self.sync0_start = self.system_ns() + begin_ns
            self.put(_SYNC0_CYCLE, struct.pack("<II", sync0_ns, device.SYNC1_NS))
            self.put(_SYNC0_START, struct.pack("<Q", self.sync0_start))
            self.put(_SYNC, bytes([0, 0x03]))

    def _map(self, number: int, logical: int, physical: int, size: int, kind: int) -> None:
        content = struct.pack("<IHBBHBBB3x", logical, size, 0, 7, physical, 0, kind, 1)
        self.put(_FMMU + 16 * number, content)

    def _must(self, wanted: int) -> None:
        status = self.ask_state(wanted, acknowledge=True)
        if status.state != wanted:
            raise NotAsDescribedError(
                f"The camera does not go to {NAMES[wanted]}: it is in {status}."
            )

    # Process data

    def cycle(self, acknowledge: int | None = None, *, command: int = Command.LRW) -> ExchangeCycle:
        """Exchange process data once; acknowledge up to a number, or nothing."""
        return self.outputs(0 if acknowledge is None else 1, acknowledge or 0, command)

    def outputs(self, control: int, number: int, command: int = Command.LRW) -> ExchangeCycle:
        """Exchange process data once with these outputs."""
        self._heartbeat = self._heartbeat + 1 & 0xFFFFFFFF
        sent = device.OUTPUT_STRUCT.pack(control, 0, number & 0xFFFFFFFF, self._heartbeat)
        data = sent + bytes(device.INPUT_DTYPE.itemsize)
        before = self.line.now_ns()
        logical, clock = self.line.exchange(
            [
                Datagram(command, _LOGICAL & 0xFFFF, _LOGICAL >> 16, data),
                Datagram(Command.APRD, self._target, _SYSTEM_TIME, bytes(8)),
            ]
        )
        came = self.line.now_ns()
        content = logical.data[device.OUTPUT_STRUCT.size :]
        return ExchangeCycle(
            logical.working_counter, content, device.NEWEST_LAYOUT.decode(content),
            int.from_bytes(clock.data, "little"), before, came,
        )  # fmt: skip

    def exchange(self) -> None:
        """Exchange process data and acknowledge frames to keep the camera in OP."""
        if not self.feeding:
            return
        header = self.cycle(self._seen).header
        if header.frames_valid:
            self._seen = header.counter + header.frames_valid - 1

    def belongs(self, cycle: ExchangeCycle) -> bool:
        """Return whether the checksum matches this camera's input."""
        return cycle.header.data_crc == device.NEWEST_LAYOUT.crc(cycle.content, self.serial)

    def run(self, cycles: int, *, step_s: float = 0.001) -> list[ExchangeCycle]:
        """Exchange process data and acknowledge all frames; return the cycles."""
        found: list[ExchangeCycle] = []
        last: int | None = None
        for _ in range(cycles):
            each = self.cycle(last)
            if each.header.frames_valid:
                last = each.header.counter + each.header.frames_valid - 1
            found.append(each)
            self.line.sleep(step_s)
        return found

    def streaming(self, *, sync0_ns: int = device.SYNC0_NS) -> ExchangeCycle:
        """Bring the camera to OP with running exposures; return a cycle with frames."""
        self.feeding = False
        self.go(INIT)
        self.go(PREOP)
        self.prepare(SAFEOP, sync0_ns=sync0_ns)
        programmed = self.line.now_ns()
        self._must(SAFEOP)
        self._must_op()
        while self.line.now_ns() - programmed < 2 * FIRST_LIMIT_NS + _BEGIN_NS:
            found = self.cycle()
            if found.header.frames_valid:
                passed = self.line.now_ns() - programmed
                self.findings.timed(
                    "First exposure after it was programmed", passed, FIRST_LIMIT_NS
                )
                return found
            self.line.sleep(_POLL_S)
        raise NotAsDescribedError("No frame comes within 120 ms of the programmed SYNC0.")

    def _must_op(self) -> None:
        self.prepare(OP)
        before = self.line.now_ns()
        self.put(_AL_CONTROL, bytes([OP, 0]))
        # Feed outputs during the wait, or the watchdog ends OP.
        while (status := self.status()).state != OP:
            if self.line.now_ns() - before > STATE_LIMIT_NS or status.state & ERROR:
                raise NotAsDescribedError(f"The camera does not go to OP: it is in {status}.")
            self.cycle()
            self.line.sleep(_POLL_S)
        self.findings.timed(STATE_TIME, self.line.now_ns() - before, STATE_LIMIT_NS)

    def _one(self, datagram: Datagram) -> Datagram:
        return self.line.exchange([datagram])[0]


@dataclass(frozen=True, slots=True)
class Rule:
    code: str
    """Identifier in reports; never reused."""
    section: str
    title: str
    """Requirement, one sentence."""
    run: Callable[[Bench, RuleFindings], None]
    """Tests the rule; may leave the camera in any state."""
