"""Plausibility of frame contents: a checksum may cover nonsense."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.fieldbus.device import FRAME_DTYPE, HEADER_STRUCT, INPUT_DTYPE, N_SLOTS, SUBPIXELS
from ocmm_core.fieldbus.report import Alarm

_SPOT_LIMIT = 8192 * SUBPIXELS
"""Larger than any sensor; wire units."""
_KNOWN_FRAME_FLAGS = 0x000F
_FRAME_WORDS = FRAME_DTYPE.itemsize // 4
_HEADER_WORDS = HEADER_STRUCT.size // 4
_WRONG_MARKS = ~(_KNOWN_FRAME_FLAGS << 16 | (1 << N_SLOTS) - 1)


def all_sound(inputs: Sequence[bytes]) -> bool:
    """Return whether all numbers of all cameras are plausible, in one pass.

    Includes the area behind the valid frames; if False, check each camera with `frames_complaint`.
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
    """Return what is implausible in the valid frames, or None."""
    if not count:
        return None
    words = np.frombuffer(content, "<i4", count=count * _FRAME_WORDS, offset=HEADER_STRUCT.size)
    frames = words.reshape(count, _FRAME_WORDS)
    # Two 16-bit numbers precede the spots.
    marks = int(np.bitwise_or.reduce(frames[:, 0]))
    if (marks & 0xFFFF) >> N_SLOTS:
        return Alarm.PAYLOAD, f"claims spots in more than {N_SLOTS} slots"
    if (marks >> 16 & 0xFFFF) & ~_KNOWN_FRAME_FLAGS:
        return Alarm.PAYLOAD, "sent frame flags that do not exist"
    spots = frames[:, 1:]
    if max(int(spots.max()), -int(spots.min())) > _SPOT_LIMIT:
        return Alarm.PAYLOAD, "sent spots far outside its sensor"
    return None
