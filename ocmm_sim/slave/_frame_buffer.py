"""Frame buffer of a software camera, from exposure to acknowledgement.

Exposure k is at start + k * period. Frames are generated ahead of time while the wire is idle and
become readable one period after their exposure. A frame is kept until acknowledged (go-back-N), so
that a lost or late cycle loses none; a full buffer drops the oldest and reports it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import CameraModel, ideal_from_pixels
from ocmm_core.fieldbus.device import (
    COUNTER_MODULUS,
    FRAME_DTYPE,
    FRAMES_PER_CYCLE,
    CameraMode,
    encode_frames,
)
from ocmm_sim.slave._pattern import CameraFrames

FIFO_FRAMES = 1024
"""128 ms at 8 kHz: a master that stalls for less than the watchdog's 100 ms loses nothing."""
CHUNK_FRAMES = 80

_AHEAD_FRAMES = 4 * CHUNK_FRAMES
_RING_FRAMES = 2048
OVERRUN_FLAG = 2
_FLAGS_AT = FRAME_DTYPE.fields["flags"][1] if FRAME_DTYPE.fields is not None else 0
_VALID_AT = FRAME_DTYPE.fields["valid"][1] if FRAME_DTYPE.fields is not None else 0
_NO_SPOT = b"\x00\x00"


class FrameBuffer:
    """Frame buffer of one camera.

    ``overruns`` counts events of frames ``lost`` in a full buffer, ``late`` frames not in time.
    """

    def __init__(self, provider: CameraFrames, camera: int) -> None:
        self._provider = provider
        self._camera = camera
        self._ring: NDArray[np.void] = np.zeros(_RING_FRAMES, FRAME_DTYPE)
        self._bytes = self._ring.view(np.uint8).data
        self.start_ns = 0
        self.period_ns = 0
        self.lost = self.overruns = self.late = 0
        self.lens: CameraModel | None = None
        """Corrects the spots, sent in mm; None sends them raw."""
        self.blind = False
        self._generated = self._tail = 0
        self._overrun_at = -1
        self._dark = range(0)

    @property
    def running(self) -> bool:
        return self.period_ns > 0

    def start(self, start_ns: int, period_ns: int) -> None:
        """Set exposure 0 to `start_ns` of the camera's clock."""
        self.start_ns, self.period_ns = start_ns, period_ns
        self.lost = 0
        self._generated = self._tail = 0
        self._overrun_at = -1
        self._dark = range(0)

    def resume(self, start_ns: int, period_ns: int, now_ns: int) -> None:
        """Follow another schedule from now on; its past exposures are lost."""
        self.start(start_ns, period_ns)
        first = max(0, self._newest(now_ns) + 1)
        self._generated = self._tail = self._overrun_at = first
        self.lost = first

    def look_again(self, now_ns: int) -> None:
        """Regenerate frames made ahead of their exposure, after a clock jump."""
        if self.running:
            self._generated = min(self._generated, max(self._tail, self._newest(now_ns) + 1))

    def darken(self, now_ns: int, count: int) -> int:
        """Make the next exposures without light; return their duration, ns."""
        if not self.running:
            return 0
        first = max(0, self._newest(now_ns) + 1)
        self._dark = range(first, first + count)
        return count * self.period_ns

    def is_dark(self, first: int, count: int) -> bool:
        """Return whether any of these frames is dark."""
        return self.blind or (first < self._dark.stop and self._dark.start < first + count)

    def stop(self) -> None:
        self.period_ns = 0

    def is_behind(self, now_ns: int) -> bool:
        """Return whether exposed frames are not generated yet."""
        return self.running and self._generated <= self._newest(now_ns)

    def generate(self, now_ns: int) -> bool:
        """Generate the next chunk of frames if due; return whether one was."""
        if not self.running or self._generated > self._newest(now_ns) + _AHEAD_FRAMES:
            return False
        first = self._generated
        valid, flags, uv = self._provider.camera_frames(self._camera, first, CHUNK_FRAMES)
        if self.lens is None:
            frames = encode_frames(valid, flags, uv)
        else:
            ideal = ideal_from_pixels(self.lens, uv)
            frames = encode_frames(valid, flags, ideal, CameraMode.CORRECTED)
        start = first % _RING_FRAMES
        whole = min(CHUNK_FRAMES, _RING_FRAMES - start)
        self._ring[start : start + whole] = frames[:whole]
        self._ring[: CHUNK_FRAMES - whole] = frames[whole:]
        self._generated += CHUNK_FRAMES
        return True

    def acknowledge(self, counter: int) -> None:
        """Release all frames up to this counter (32 bits, as on the wire)."""
        # The nearest frame with these 32 bits; a value far from the buffer is no acknowledgement.
        ahead = (counter + 1 - self._tail) % COUNTER_MODULUS
        if 0 < ahead <= FRAMES_PER_CYCLE:
            self._tail += ahead

    def take(self, now_ns: int) -> tuple[int, int]:
        """Return the first frame to send and their number; drop frames without room."""
        exposed = self._newest(now_ns) + 1
        end = min(exposed, self._generated)
        if end < exposed:
            self.late += 1
        if end - self._tail > FIFO_FRAMES:
            self.overruns += 1
            self.lost += end - FIFO_FRAMES - self._tail
            self._tail = self._overrun_at = end - FIFO_FRAMES
        return self._tail, max(0, min(FRAMES_PER_CYCLE, end - self._tail))

    def follows_loss(self, frame: int) -> bool:
        """Return whether frames were dropped just before this one."""
        return frame == self._overrun_at

    def copy(self, first: int, count: int, target: bytearray, at: int) -> None:
        """Copy frames in wire format into `target`."""
        size = FRAME_DTYPE.itemsize
        start = first % _RING_FRAMES
        whole = min(count, _RING_FRAMES - start)
        target[at : at + whole * size] = self._bytes[start * size : (start + whole) * size]
        rest = count - whole
        target[at + whole * size : at + count * size] = self._bytes[: rest * size]
        if self.is_dark(first, count):
            for frame in range(first, first + count):
                if self.blind or frame in self._dark:
                    place = at + (frame - first) * size + _VALID_AT
                    target[place : place + len(_NO_SPOT)] = _NO_SPOT
        if count and self.follows_loss(first):
            target[at + _FLAGS_AT] |= OVERRUN_FLAG

    def _newest(self, now_ns: int) -> int:
        return (now_ns - self.start_ns) // self.period_ns - 1
