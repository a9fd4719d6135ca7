"""Software camera: a slave controller with frames, objects and errors."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable

from ocmm_core.errors import InputError
from ocmm_core.fieldbus import device
from ocmm_sim.firmware import FirmwareBanks, FoeServer
from ocmm_sim.slave import _registers as registers
from ocmm_sim.slave._coe import CoeServer
from ocmm_sim.slave._electronics import Electronics
from ocmm_sim.slave._esc import Esc
from ocmm_sim.slave._frames import CHUNK_FRAMES as CHUNK_FRAMES
from ocmm_sim.slave._frames import SENSOR_PX, CameraFrames, FrameBuffer
from ocmm_sim.slave._sdo_values import Address
from ocmm_sim.slave._sii import sii_image
from ocmm_sim.slave._store import CameraStore, Diagnosis

_AL_INCONSISTENT = 0x0026
_SYNC_CODES = (0x001A, 0x002C, *range(0x0030, 0x0038))
"""AL status codes of falls caused by the sync signal."""
_LOST_LINKS = slice(0x0310, 0x0314)
_SYNC0_MODE = 2
_FOE, _MAILBOX_HEAD = 4, 6
_SOFTWARE_VERSION = 0x100A
# Plain integers: enumeration flags cost more than the rest of a frame.
_OPERATIONAL, _SYNCHRONISED = (
    int(device.CameraStatus.OPERATIONAL),
    int(device.CameraStatus.SYNCHRONISED),
)
_OVERRUN, _DARK = int(device.CameraStatus.OVERRUN), int(device.CameraStatus.DARK)
_DIAGNOSIS, _STREAM = int(device.CameraStatus.DIAGNOSIS), int(device.Control.STREAM)


class SoftwareCamera:
    """One camera on the wire.

    Pass the same ``store`` and ``banks``, its non-volatile memory and firmware, after a restart;
    ``layout``: input layout, which defines the revision; ``sensor``: reported serial number and
    size, px; 0: the camera's own number. Faults: ``frozen``, the application hangs while its
    controller answers; ``mailbox_hangs``, mailboxes are accepted and never answered.
    """

    def __init__(
        self,
        index: int,
        serial: int,
        alias: int,
        provider: CameraFrames,
        boot_counter: int = 1,
        store: CameraStore | None = None,
        layout: device.InputLayout = device.NEWEST_LAYOUT,
        sensor: tuple[int, int, int] = (0, SENSOR_PX, SENSOR_PX),
        banks: FirmwareBanks | None = None,
    ) -> None:
        self._layout = layout
        self._crc_begin = layout.crc_begin(serial)
        self.esc = Esc(sii_image(serial, alias, layout), 7_000_000_000 * (index + 1), self)
        self.buffer = FrameBuffer(provider, index)
        self.frozen = self.mailbox_hangs = False
        self._inputs = memoryview(self.esc.memory)[
            device.INPUT_START : device.INPUT_START + device.INPUT_DTYPE.itemsize
        ]
        self._boot_counter = boot_counter
        self._cycle = 0
        self._state = registers.INIT
        self._crc = device.CameraConfig().crc()
        self._period_override = 0
        self._outputs_ns = 0
        self._missed = 0
        self._banks = banks or FirmwareBanks()
        self.foe = FoeServer(
            self._banks, device.MAILBOX_BYTES, lambda: self.esc.state == registers.BOOT
        )
        self.esc.can_boot = True
        self._diagnosis = Diagnosis(lambda: self.esc.system_time_ns, self._send_emergency)
        self.electronics = Electronics(
            index,
            serial,
            provider,
            store or CameraStore(),
            self._diagnosis,
            lambda frames: self.buffer.darken(self.esc.system_time_ns, frames),
            sensor,
        )
        self.coe = CoeServer(
            device.object_dictionary(serial, layout),
            device.MAILBOX_BYTES,
            {**self.electronics.live(), **self._live()},
            self.electronics.written(),
            lambda: self.esc.state <= registers.PREOP,
        )
        self._tell_version()
        if sensor[0]:
            self.coe.set_value(device.INFORMATION, 1, struct.pack("<I", sensor[0]))

    @property
    def period_override(self) -> int:
        """Return the faulty exposure period, ns, that is in effect; 0: none; for tests."""
        return self._period_override

    @period_override.setter
    def period_override(self, period_ns: int) -> None:
        self._period_override = period_ns
        if self.buffer.running:
            self.buffer.resume(*self._schedule(), self.esc.system_time_ns)

    def answer(self, mailbox: bytes) -> bytes | None:
        if self.mailbox_hangs:
            return None
        if len(mailbox) >= _MAILBOX_HEAD and mailbox[5] & 0x0F == _FOE:
            (length,) = struct.unpack_from("<H", mailbox)
            return self.foe.answer(mailbox[_MAILBOX_HEAD : _MAILBOX_HEAD + length])
        # BOOT supports file access only.
        return None if self._state == registers.BOOT else self.coe.answer(mailbox)

    def emergency(
        self, code: int, register: int = device.ErrorRegister.GENERIC, data: bytes = b""
    ) -> None:
        """Send an emergency message and record it; code 0 ends an error."""
        self._diagnosis.report(code, register, data)

    def state_changed(self, state: int) -> None:
        """Start or stop the exposures with the state."""
        before, self._state = self._state, state
        if state == registers.INIT:
            self.coe.reset()
            self.foe.reset()
            if before == registers.BOOT:
                self._start_firmware()
        if state == registers.PREOP:
            self._banks.confirm()
        if (
            before == registers.OP
            and state == registers.SAFEOP
            and not self.esc.memory[registers.WATCHDOG_STATUS] & 1
        ):
            communication = device.ErrorRegister.GENERIC | device.ErrorRegister.COMMUNICATION
            self.emergency(device.ErrorCode.WATCHDOG, communication)
        if state == registers.OP:
            self._outputs_ns = 0
            if self._diagnosis.register & device.ErrorRegister.COMMUNICATION:
                self.emergency(device.ErrorCode.RESET, 0)
        if state < registers.SAFEOP:
            self.buffer.stop()
        elif not self.buffer.running:
            self._start_exposures(state)

    def outputs_written(self) -> None:
        """Process the master's acknowledgement."""
        control, _pattern, counter, _heartbeat = device.OUTPUT_STRUCT.unpack_from(
            self.esc.memory, device.OUTPUT_START
        )
        now, cycle = self.esc.now_ns, self._bus_cycle_ns()
        if cycle and self._outputs_ns and self._state == registers.OP:
            self._missed += max(0, round((now - self._outputs_ns) / cycle) - 1)
        self._outputs_ns = now
        if control & _STREAM and self.buffer.running and not self.frozen:
            self.buffer.acknowledge(counter)

    def refresh_inputs(self) -> None:
        """Write header and frames to the input memory."""
        if self.frozen:
            return
        buffer, esc = self.buffer, self.esc
        memory = esc.memory
        first = count = 0
        if buffer.running:
            first, count = buffer.pop(esc.system_time_ns)
        status = (
            (_OPERATIONAL if esc.state == registers.OP else 0)
            | (_SYNCHRONISED if esc.is_synchronised else 0)
            | (_OVERRUN if buffer.follows_loss(first) else 0)
            | (_DARK if buffer.is_dark(first, count) else 0)
            | (_DIAGNOSIS if self._diagnosis.pending else 0)
        )
        self._cycle = (self._cycle + 1) % self._layout.cycle_counters
        header_end = device.INPUT_START + device.HEADER_STRUCT.size
        memory[device.INPUT_START : header_end] = self._layout.encode(
            device.Header(
                first % device.COUNTER_MODULUS, buffer.start_ns + first * buffer.period_ns,
                buffer.period_ns, count, self._cycle, status, self._crc, self._boot_counter,
            )
        )  # fmt: skip
        buffer.copy(first, count, memory, device.INPUT_START + device.HEADER_STRUCT.size)
        crc = zlib.crc32(self._inputs, self._crc_begin)
        device.DATA_CRC.pack_into(memory, device.INPUT_START + device.DATA_CRC_AT, crc)

    def generate(self, now_ns: int) -> bool:
        self.esc.now_ns = now_ns
        self.buffer.blind = self.electronics.sensor_fails
        return self.buffer.generate(self.esc.system_time_ns) or self.electronics.work(now_ns)

    def keep_up(self, now_ns: int) -> None:
        """Make all frames exposed by now."""
        self.esc.now_ns = now_ns
        while self.buffer.is_behind(self.esc.system_time_ns):
            self.generate(now_ns)

    def _start_firmware(self) -> None:
        """Restart with the selected firmware bank, as a camera leaving BOOT."""
        self._banks.start()
        self._tell_version()

    def _tell_version(self) -> None:
        version = self._banks.version.encode("ascii")
        self.coe.set_value(_SOFTWARE_VERSION, 0, version)
        self.coe.set_value(device.VERSIONS, 1, version)

    def _start_exposures(self, state: int) -> None:
        """Apply the configuration and start; refuse contradictions."""
        lens = self.electronics.lens
        try:
            config = self._config()
            self.electronics.configure(config)
        except InputError:
            self.esc.fall_back(registers.PREOP, _AL_INCONSISTENT)
            return
        width, height = self.electronics.sensor_px
        off = any(
            left + across > width or top + down > height
            for left, top, across, down in config.windows
        )
        if off or (config.mode is device.CameraMode.CORRECTED and lens is None):
            self.esc.fall_back(registers.PREOP, _AL_INCONSISTENT)
            return
        self._crc = config.crc()
        self.buffer.lens = lens if config.mode is device.CameraMode.CORRECTED else None
        if self.esc.sync0 is not None or state == registers.OP:
            self.buffer.start(*self._schedule())

    def _schedule(self) -> tuple[int, int]:
        """Return time of exposure 0 and period, ns of system time."""
        sync0 = self.esc.sync0
        start, period = sync0 or (self.esc.system_time_ns, self._config().frame_period_ns)
        return start, self._period_override or period

    def _send_emergency(self, code: int, register: int, data: bytes) -> None:
        if self.esc.state >= registers.PREOP and not self.mailbox_hangs:
            self.esc.post(self.coe.emergency(code, register, data))

    def _bus_cycle_ns(self) -> int:
        sync0, sync1 = struct.unpack_from("<II", self.esc.memory, registers.SYNC0_CYCLE)
        return int(sync0 + sync1) if self.esc.is_synchronised else 0

    def _sync_failed(self) -> bool:
        (code,) = struct.unpack_from("<H", self.esc.memory, registers.AL_STATUS_CODE)
        return code in _SYNC_CODES

    def _live(self) -> dict[Address, Callable[[], bytes]]:
        memory = self.esc.memory
        entries: dict[Address, Callable[[], bytes]] = {
            (device.TIMESTAMP, 0): lambda: struct.pack(
                "<Q", self.esc.system_time_ns & (1 << 64) - 1
            ),
            (device.COUNTERS, 1): lambda: struct.pack("<I", self.buffer.lost & 0xFFFFFFFF),
            (device.COUNTERS, 2): lambda: struct.pack("<I", memory[registers.WATCHDOG_COUNT]),
            (device.COUNTERS, 3): lambda: struct.pack("<I", self.buffer.overruns),
            (device.COUNTERS, 4): lambda: struct.pack("<I", self.coe.bad_mailboxes),
            (device.COUNTERS, 5): lambda: struct.pack("<I", sum(memory[_LOST_LINKS])),
            (device.COUNTERS, 6): lambda: struct.pack("<I", self._diagnosis.count),
        }
        for index in (device.OUTPUT_SYNC, device.INPUT_SYNC):
            entries[index, device.SYNC_MODE] = lambda: struct.pack(
                "<H", _SYNC0_MODE if self.esc.sync0 is not None else 0
            )
            entries[index, device.SYNC_CYCLE] = lambda: struct.pack("<I", self._bus_cycle_ns())
            entries[index, device.SYNC_MISSED] = lambda: struct.pack(
                "<H", min(self._missed, 0xFFFF)
            )
            entries[index, device.SYNC_EXCEEDED] = lambda: struct.pack(
                "<H", min(self.buffer.late, 0xFFFF)
            )
            entries[index, device.SYNC_ERROR] = lambda: bytes([self._sync_failed()])
        for start, pdos in (
            (device.INPUT_START, self._layout.input_pdos),
            (device.OUTPUT_START, (device.OUTPUT_PDO,)),
        ):
            at = start
            for pdo in pdos:
                for entry in pdo.entries:
                    place = slice(at, at + entry.bits // 8)
                    entries[entry.index, entry.sub] = lambda place=place: bytes(memory[place])  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
                    at = place.stop
        return entries

    def _config(self) -> device.CameraConfig:
        period, exposure, threshold, mode, strobe = (
            int.from_bytes(self.coe.value(device.CONFIGURATION, sub), "little")
            for sub in range(1, 6)
        )
        numbers = [
            int.from_bytes(self.coe.value(device.WINDOWS, sub), "little")
            for sub in range(1, 4 * device.N_SLOTS + 1)
        ]
        windows: list[device.Window] = list(
            zip(numbers[::4], numbers[1::4], numbers[2::4], numbers[3::4], strict=True)
        )
        while windows and not any(windows[-1]):
            windows.pop()
        return device.CameraConfig(
            period, exposure, threshold, device.CameraMode(mode), strobe, tuple(windows)
        )
