"""The software camera: a slave controller with the buffer of frames that is behind it.

Exposure k happens at SYNC0 start + k * period. The frames are generated ahead of time while the
wire is idle and become readable one period after their exposure. The camera keeps every frame
until the master has acknowledged it (go-back-N), so that a lost or late cycle loses no frame; a
buffer that is full drops the oldest and says so.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus.camera_objects import (
    CONFIGURATION,
    SM_ASSIGNMENT,
    WINDOWS,
    object_dictionary,
)
from ocmm_core.fieldbus.camera_slave import (
    COUNTER_MODULUS,
    DATA_CRC,
    DATA_CRC_AT,
    FRAME_DTYPE,
    FRAMES_PER_CYCLE,
    HEADER_STRUCT,
    INPUT_DTYPE,
    INPUT_START,
    MAILBOX_BYTES,
    N_SLOTS,
    OUTPUT_START,
    OUTPUT_STRUCT,
    SM_INPUTS,
    CameraConfig,
    CameraMode,
    CameraStatus,
    Control,
    encode_frames,
)
from ocmm_core.fieldbus.profile_objects import COUNTERS
from ocmm_core.simulation.coe import CoeServer
from ocmm_core.simulation.esc import Esc
from ocmm_core.simulation.pattern import CameraFrames
from ocmm_core.simulation.registers import OP, SAFEOP
from ocmm_core.simulation.sii import sii_image

FIFO_FRAMES = 1024
"""128 ms at 8 kHz: a master that stalls for less than the watchdog's 100 ms loses nothing."""
CHUNK_FRAMES = 80

_AHEAD_FRAMES = 4 * CHUNK_FRAMES
_RING_FRAMES = 2048
_OVERRUN_FLAG = 2
_FLAGS_AT = FRAME_DTYPE.fields["flags"][1] if FRAME_DTYPE.fields is not None else 0


class FrameBuffer:
    """Frames of one camera between their exposure and their acknowledgement.

    Parameters
    ----------
    provider, camera
        Where the frames come from and which camera this is.

    Attributes
    ----------
    lost
        Frames dropped because the buffer was full.
    """

    def __init__(self, provider: CameraFrames, camera: int) -> None:
        self._provider = provider
        self._camera = camera
        self._ring: NDArray[np.void] = np.zeros(_RING_FRAMES, FRAME_DTYPE)
        self._bytes = self._ring.view(np.uint8).data
        self.start_ns = 0
        self.period_ns = 0
        self.lost = 0
        self._generated = self._tail = 0
        self._overrun_at = -1

    @property
    def running(self) -> bool:
        """Return whether exposures are being made."""
        return self.period_ns > 0

    def start(self, start_ns: int, period_ns: int) -> None:
        """Let exposure 0 happen at ``start_ns`` of the camera's clock."""
        self.start_ns, self.period_ns = start_ns, period_ns
        self.lost = 0
        self._generated = self._tail = 0
        self._overrun_at = -1

    def stop(self) -> None:
        """Make no more exposures."""
        self.period_ns = 0

    def generate(self, now_ns: int) -> bool:
        """Make the next chunk of frames if it is due; say whether something was made."""
        if not self.running or self._generated > self._newest(now_ns) + _AHEAD_FRAMES:
            return False
        first = self._generated
        frames = encode_frames(*self._provider.camera_frames(self._camera, first, CHUNK_FRAMES))
        self._ring[(first + np.arange(CHUNK_FRAMES)) % _RING_FRAMES] = frames
        self._generated += CHUNK_FRAMES
        return True

    def acknowledge(self, counter: int) -> None:
        """Let go of all frames up to the one with this counter (32 bits, as on the wire)."""
        # The nearest frame with these 32 bits; anything far from the buffer is not an answer to it.
        ahead = (counter + 1 - self._tail) % COUNTER_MODULUS
        if 0 < ahead <= FRAMES_PER_CYCLE:
            self._tail += ahead

    def take(self, now_ns: int) -> tuple[int, int]:
        """Return the first frame to send and how many; drops what no longer has room."""
        end = min(self._newest(now_ns) + 1, self._generated)
        if end - self._tail > FIFO_FRAMES:
            self.lost += end - FIFO_FRAMES - self._tail
            self._tail = self._overrun_at = end - FIFO_FRAMES
        return self._tail, max(0, min(FRAMES_PER_CYCLE, end - self._tail))

    def follows_loss(self, frame: int) -> bool:
        """Return whether frames were dropped just before this one."""
        return frame == self._overrun_at

    def copy(self, first: int, count: int, target: bytearray, at: int) -> None:
        """Copy frames as they are sent into ``target``."""
        size = FRAME_DTYPE.itemsize
        start = first % _RING_FRAMES
        whole = min(count, _RING_FRAMES - start)
        target[at : at + whole * size] = self._bytes[start * size : (start + whole) * size]
        rest = count - whole
        target[at + whole * size : at + count * size] = self._bytes[: rest * size]
        if count and self.follows_loss(first):
            target[at + _FLAGS_AT] |= _OVERRUN_FLAG

    def _newest(self, now_ns: int) -> int:
        return (now_ns - self.start_ns) // self.period_ns - 1


class SoftwareCamera:
    """One camera on the wire.

    Parameters
    ----------
    index
        Its number for the provider.
    serial, alias
        Its identity.
    provider
        What it sees.
    boot_counter
        How often it was switched on.

    Attributes
    ----------
    frozen
        Fault: the camera's application stands still while its controller goes on answering.
    """

    def __init__(
        self, index: int, serial: int, alias: int, provider: CameraFrames, boot_counter: int = 1
    ) -> None:
        self.esc = Esc(sii_image(serial, alias), 7_000_000_000 * (index + 1), self)
        self.buffer = FrameBuffer(provider, index)
        self.frozen = False
        self._inputs = memoryview(self.esc.memory)[INPUT_START : INPUT_START + INPUT_DTYPE.itemsize]
        self._boot_counter = boot_counter
        self._cycle = 0
        self._crc = CameraConfig().crc()
        self.coe = CoeServer(
            object_dictionary(serial),
            MAILBOX_BYTES,
            {(COUNTERS, 1): lambda: struct.pack("<I", self.buffer.lost & 0xFFFFFFFF)},
        )

    def answer(self, mailbox: bytes) -> bytes | None:
        """Return the answer to a mailbox; see `Application`."""
        return self.coe.answer(mailbox)

    def state_changed(self, state: int) -> None:
        """Start or stop the exposures with the state."""
        if state < SAFEOP:
            self.buffer.stop()
            return
        config = self._config()
        self._crc = config.crc()
        if self.buffer.running:
            return
        sync0 = self.esc.sync0
        if sync0 is not None:
            self.buffer.start(*sync0)
        elif state == OP:
            self.buffer.start(self.esc.system_time_ns, config.frame_period_ns)

    def outputs_written(self) -> None:
        """Take the master's acknowledgement."""
        control, _pattern, counter, _heartbeat = OUTPUT_STRUCT.unpack_from(
            self.esc.memory, OUTPUT_START
        )
        if control & Control.STREAM and self.buffer.running and not self.frozen:
            self.buffer.acknowledge(counter)

    def refresh_inputs(self) -> None:
        """Put header and frames where the master reads them."""
        if self.frozen:
            return
        buffer, memory = self.buffer, self.esc.memory
        first = count = 0
        if buffer.running:
            first, count = buffer.take(self.esc.system_time_ns)
        status = CameraStatus.OPERATIONAL if self.esc.state == OP else 0
        status |= CameraStatus.SYNCHRONISED if self.esc.sync0 is not None else 0
        status |= CameraStatus.OVERRUN if buffer.follows_loss(first) else 0
        self._cycle = self._cycle + 1 & 0xFF
        HEADER_STRUCT.pack_into(
            memory,
            INPUT_START,
            first % COUNTER_MODULUS,
            buffer.start_ns + first * buffer.period_ns,
            buffer.period_ns,
            count,
            self._cycle,
            status,
            self._crc,
            self._boot_counter,
            0,
        )
        buffer.copy(first, count, memory, INPUT_START + HEADER_STRUCT.size)
        crc = zlib.crc32(self._inputs)
        DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

    def generate(self, now_ns: int) -> bool:
        """Work ahead; say whether something was done."""
        self.esc.now_ns = now_ns
        return self.buffer.generate(self.esc.system_time_ns)

    def remap(self, position: int, mapping_index: int) -> None:
        """Fault: let another PDO stand at a position of the input assignment."""
        value = struct.pack("<H", mapping_index)
        self.coe.set_value(SM_ASSIGNMENT + SM_INPUTS, position, value)

    def _config(self) -> CameraConfig:
        period, exposure, threshold, mode, strobe = (
            int.from_bytes(self.coe.value(CONFIGURATION, sub), "little") for sub in range(1, 6)
        )
        numbers = [
            int.from_bytes(self.coe.value(WINDOWS, sub), "little")
            for sub in range(1, 4 * N_SLOTS + 1)
        ]
        left, top, width, height = (numbers[part::4] for part in range(4))
        windows = tuple(zip(left, top, width, height, strict=True))
        return CameraConfig(period, exposure, threshold, CameraMode(mode), strobe, windows)
