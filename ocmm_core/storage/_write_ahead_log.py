"""Read the write-ahead log of a job as SQLite recovers it.

A frame counts if it carries the salts of the head and its checksum continues that of the frame
before; a step counts up to its commit frame (SQLite, "WAL-mode File Format"). Reading the log here
needs no second file, touches nothing next to the job, and shows an incomplete end.

The checksum is linear modulo 2^32: with the pairs of words x, y of a frame and M = [[1, 1], [1, 2]]
the next state is M s + (x, x + y). So the contribution of each frame is one product with powers of
M, computed for many frames at a time.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

_HEAD = struct.Struct(">8I")
_FRAME = struct.Struct(">6I")
HEAD_SIZE = _HEAD.size
_MAGIC, _VERSION = 0x377F0682, 3007000
_MASK = 0xFFFFFFFF
_FEWEST, _MOST = 512, 65536
"""Bytes of a page."""
_TOGETHER = 1 << 20
"""Bytes read and checked at a time."""
_OLDER = 1 << 16
"""Range of the salt of older generations behind the current one: it grows by one for each."""

Words = npt.NDArray[np.uint32]
Read = Callable[[int, int], bytes]
"""Bytes from an offset on, fewer at the end."""


@dataclass(frozen=True, slots=True)
class LogPages:
    """Complete steps of a log."""

    pages: dict[int, bytes]
    """Newest content of each page by its number, from 1."""
    page_size: int = 0
    n_pages: int = 0
    """Bytes of a page, and pages of the file after the last step; 0 without a complete step."""
    head: bytes = b""
    """Head of the log: changes when the log starts again."""
    left_out: str = ""
    """Sentence about an incomplete end of the log; empty without one."""


def read_log(read: Read, size: int, most: int) -> LogPages:
    """Return the complete steps of a log of ``size`` bytes.

    `most`: Maximum bytes of the file that results.
    """
    if not size:
        return LogPages({})
    head = read(0, HEAD_SIZE)
    fields = _HEAD.unpack(head) if len(head) == HEAD_SIZE else None
    if fields is None or not _is_head(fields, head):
        return LogPages(
            {},
            head=head,
            left_out=f"The write-ahead log has no valid head: its {size:,} bytes cannot be read, "
            "and steps that were stored in them are missing.",
        )
    page_size, order = fields[2], ">" if fields[0] & 1 else "<"
    salts, state = (fields[4], fields[5]), (fields[6], fields[7])
    taken: dict[int, bytes] = {}
    pending: dict[int, bytes] = {}
    offset, whole, n_pages = HEAD_SIZE, HEAD_SIZE, 0
    frame_size = _FRAME.size + page_size
    together = max(_TOGETHER // frame_size, 1) * frame_size
    stale = False
    while block := read(offset, together):
        n_frames = len(block) // frame_size
        parts = _contributions(block[: n_frames * frame_size], page_size, order)
        for k in range(n_frames):
            at = k * frame_size
            number, commit, *rest = _FRAME.unpack_from(block, at)
            state = _next(state, parts[k], page_size)
            fits = (rest[0], rest[1]) == salts and (rest[2], rest[3]) == state
            if not fits or not 0 < number <= most // page_size or commit > most // page_size:
                stale = 0 < (salts[0] - rest[0]) & _MASK < _OLDER
                break
            pending[number] = block[at + _FRAME.size : at + frame_size]
            if commit:
                taken.update(pending)
                pending.clear()
                n_pages, whole = commit, offset + at + frame_size
        else:
            offset += n_frames * frame_size
            if len(block) == together:
                continue
        break
    # Behind the newest step lie frames of an older generation, of which nothing is missing.
    left = 0 if stale and not pending else size - whole
    return LogPages(taken, page_size, n_pages, head, _left_out(left) if left else "")


def _left_out(left: int) -> str:
    return (
        f"The last {left:,} bytes of the write-ahead log are no complete step: what was being "
        "stored when writing stopped is not in the job. Compare its last point with your notes."
    )


def _is_head(fields: tuple[int, ...], head: bytes) -> bool:
    magic, version, page_size = fields[:3]
    if magic | 1 != _MAGIC | 1 or version != _VERSION:
        return False
    if not _FEWEST <= page_size <= _MOST or page_size & (page_size - 1):
        return False
    words = np.frombuffer(head[:24], dtype=">u4" if magic & 1 else "<u4")
    s0 = s1 = 0
    for x, y in words.reshape(-1, 2).tolist():
        s0 = (s0 + x + s1) & _MASK
        s1 = (s1 + y + s0) & _MASK
    return fields[6:] == (s0, s1)


def _contributions(block: bytes, page_size: int, order: str) -> list[tuple[int, int]]:
    """Return the contribution of each frame to the checksum."""
    if not block:
        return []
    words = np.frombuffer(block, dtype=f"{order}u4").reshape(-1, (_FRAME.size + page_size) // 4)
    weights, _ = _powers(page_size)
    # The checksum covers number and commit of the frame, and the page.
    sums = words[:, :2].astype(np.uint32) @ weights[:2]
    sums += words[:, _FRAME.size // 4 :].astype(np.uint32) @ weights[2:]
    return [(int(a), int(b)) for a, b in sums]


def _next(state: tuple[int, int], part: tuple[int, int], page_size: int) -> tuple[int, int]:
    a, b, c = _powers(page_size)[1]
    return (
        (a * state[0] + b * state[1] + part[0]) & _MASK,
        (b * state[0] + c * state[1] + part[1]) & _MASK,
    )


@lru_cache(maxsize=4)
def _powers(page_size: int) -> tuple[Words, tuple[int, int, int]]:
    """Return the weights of the words of a frame, and the power of M that a frame applies."""
    n = (8 + page_size) // 8
    a, b, c = 1, 0, 1
    weights = np.empty((2 * n, 2), dtype=np.uint32)
    for k in reversed(range(n)):
        # M^(n-1-k) = [[a, b], [b, c]], applied to (x, x + y).
        weights[2 * k] = ((a + b) & _MASK, (b + c) & _MASK)
        weights[2 * k + 1] = (b, c)
        a, b, c = (a + b) & _MASK, (b + c) & _MASK, (b + 2 * c) & _MASK
    return weights, (a, b, c)
