"""Can the numbers in the frames be true? A check sum may have been made over nonsense."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.fieldbus.device import FRAME_DTYPE, HEADER_STRUCT, INPUT_DTYPE, N_SLOTS, SUBPIXELS
from ocmm_core.fieldbus.report import Alarm

_SPOT_LIMIT = 8192 * SUBPIXELS
"""No sensor is larger; in pixels on the wire."""
_KNOWN_FRAME_FLAGS = 0x000F
_FRAME_WORDS = FRAME_DTYPE.itemsize // 4
_HEADER_WORDS = HEADER_STRUCT.size // 4
_WRONG_MARKS = ~(_KNOWN_FRAME_FLAGS << 16 | (1 << N_SLOTS) - 1)


def all_sound(inputs: Sequence[bytes]) -> bool:
    """Say whether no number of any camera can be wrong in itself: one look for all of them.

    It also looks at what stands behind the valid frames. Where it says no, `frames_complaint`
    looks at each camera alone.
    """
    together = b"".join(inputs)
    if not together or len(together) != len(inputs) * INPUT_DTYPE.itemsize:
        return False
    words = np.frombuffer(together, "<i4").reshape(len(inputs), -1)[:, _HEADER_WORDS:]
    frames = words.reshape(-1, _FRAME_WORDS)
    marks = int(np.bitwise_or.reduce(frames[:, 0]))
    spots = frames[:, 1:]
    largest = int(np.maximum.reduce(spots, axis=None))
    smallest = int(np.minimum.reduce(spots, axis=None))
    return not marks & _WRONG_MARKS and max(largest, -smallest) <= _SPOT_LIMIT


def frames_complaint(content: bytes, count: int) -> tuple[Alarm, str] | None:
    """Return what is wrong with the frames themselves: the check sum was made over nonsense."""
    if not count:
        return None
    words = np.frombuffer(content, "<i4", count=count * _FRAME_WORDS, offset=HEADER_STRUCT.size)
    frames = words.reshape(count, _FRAME_WORDS)
    # Two numbers of 16 bits each stand before the spots.
    marks = int(np.bitwise_or.reduce(frames[:, 0]))
    if (marks & 0xFFFF) >> N_SLOTS:
        return Alarm.PAYLOAD, f"claims spots in more than {N_SLOTS} slots"
    if (marks >> 16 & 0xFFFF) & ~_KNOWN_FRAME_FLAGS:
        return Alarm.PAYLOAD, "sent frame flags that do not exist"
    spots = frames[:, 1:]
    if max(int(spots.max()), -int(spots.min())) > _SPOT_LIMIT:
        return Alarm.PAYLOAD, "sent spots far outside its sensor"
    return None
