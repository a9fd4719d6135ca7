"""Checks that this program could have stored the rows of a job file, before any computation.

An audit can be forged with its file. Faults are the end of one sentence.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import datetime
from functools import lru_cache
from typing import Any

import numpy as np

_KINDS: dict[str, tuple[type, ...]] = {
    "head": (int, *(str,) * 12),
    "observation": (
        int, str, float, int, int, int, bytes, bytes, bytes, float, bytes, str, bytes, float, str,
    ),
    "annulment": (int, str, str),
    "event": (int, str, str, str),
    "reference": (int, str, str, str, bytes, int),
    "reference_observation": (int, str, bytes),
    "seal": (int, str, str),
}  # fmt: skip
"""Types of the columns of `AUDITED`, in order, and of the signatures."""

_TIME, _RADIUS, _CHI2 = 2, 9, 13
_SPOTS_SHAPE, _SPOTS = 11, 12
_ARRAYS, _SIZES = (6, 7, 8, 10), (24, 72, 24, 72)
"""Columns of the arrays of a point, and their bytes."""
_TOGETHER = 1024
"""Rows whose numbers are checked together."""

_MOST_NUMBER = 2**31 - 1
_MOST_FRAME = 2**62
_MOST_FRAMES = 10**9
_FARTHEST = 1e7
"""mm, mm^2 or px: limit of all arrays of a point, whose square is far from overflow."""
_LOWEST = np.array((-np.inf, 0.0, 0.0))
_HIGHEST = np.array((np.inf, 1e3, 1e30))
"""Of time in s, radius of the ball in mm, and chi-square."""
_LONGEST_NAME = 200
_FIRST_YEAR, _LAST_YEAR = 1900, 9900
_KEY_LENGTH, _SIGNATURE_LENGTH = 44, 88
"""Characters of 32 and of 64 bytes in Base64."""
_SHAPE = re.compile(r"([0-9]{1,3}),([0-9]{1,3}),2")


def kind_fault(table: str, row: Sequence[Any]) -> str:
    """Return the type error of a row, possibly with further columns; empty if valid."""
    kinds = _KINDS[table]
    if tuple(map(type, row[: len(kinds)])) == kinds:
        return ""
    return f"the {table} {str(row[0])[:40]} holds a value of another kind"


def head_fault(row: Sequence[Any]) -> str:
    """Return the fault of the head's row; empty if none."""
    found = kind_fault("head", row)
    if not found and not _is_time(row[2]):
        found = f"its time {row[2][:40]!r} is no ISO 8601 time"
    return found


def event_fault(row: Sequence[Any]) -> str:
    """Return the fault of an event, ``id`` first; empty if none."""
    return kind_fault("event", row) or stamp_fault("event", row[0], row[1])


def stamp_fault(what: str, number: int, time_utc: object) -> str:
    """Return the fault of a time stamp; empty if none."""
    if isinstance(time_utc, str) and _is_time(time_utc):
        return ""
    return f"the time of {what} {number} is no ISO 8601 time"


def point_fault(rows: Sequence[Sequence[Any]]) -> str:
    """Return the fault of a row of ``observation``, or ""; arrays are checked in batches."""
    for start in range(0, len(rows), _TOGETHER):
        some = rows[start : start + _TOGETHER]
        faults = (kind_fault("observation", row) or _place_fault(row) for row in some)
        found = next(filter(None, faults), "")
        found = found or _number_fault(some)
        found = found or spots_fault([(row[0], row[_SPOTS_SHAPE], row[_SPOTS]) for row in some])
        if found:
            return found
    return ""


def beside_fault(rows: Sequence[Sequence[Any]]) -> str:
    """Return the fault of one of the rows of ``reference_observation``."""
    found = next(filter(None, (kind_fault("reference_observation", row) for row in rows)), "")
    return found or spots_fault(rows)


def seal_fault(rows: Iterable[Sequence[Any]], steps: int) -> str:
    """Return the fault of a row of ``seal`` (signed step, key, signature), or ""."""
    for row in rows:
        found = kind_fault("seal", row)
        if not found and not 0 < row[0] <= steps:
            found = f"a signature is on step {row[0]}, and it has {steps}"
        if not found and (len(row[1]), len(row[2])) != (_KEY_LENGTH, _SIGNATURE_LENGTH):
            found = f"the signature of step {row[0]} has another length"
        if found:
            return found
    return ""


def reference_fault(row: Sequence[Any]) -> str:
    """Return the fault of the reference body's row; empty if none."""
    found = kind_fault("reference", row)
    if not found and not 0 < row[5] <= _MOST_FRAMES:
        found = f"its reference body is the mean of {row[5]} frames"
    return found or spots_fault([(row[0], row[3], row[4])])


def spots_fault(rows: Sequence[Sequence[Any]]) -> str:
    """Return the fault of spots, rows of number, shape and blob; unseen is NaN."""
    for start in range(0, len(rows), _TOGETHER):
        some = rows[start : start + _TOGETHER]
        for number, shape, blob, *_ in some:
            if _spots_bytes(shape) != len(blob):
                return f"the spots of point {number} do not have the shape {shape[:40]!r}"
        if _is_far(b"".join(row[2] for row in some)):
            number = next(row[0] for row in some if _is_far(row[2]))
            return f"the spots of point {number} hold a number that no camera gives"
    return ""


def _number_fault(rows: Sequence[Sequence[Any]]) -> str:
    scalars = np.array([(row[_TIME], row[_RADIUS], row[_CHI2]) for row in rows])
    good = (np.isfinite(scalars) & (scalars >= _LOWEST) & (scalars <= _HIGHEST)).all(axis=1)
    blob = b"".join([row[k] for row in rows for k in _ARRAYS])
    good &= (np.abs(np.frombuffer(blob, dtype="<f8").reshape(len(rows), -1)) <= _FARTHEST).all(
        axis=1
    )
    if good.all():
        return ""
    return f"point {rows[int(np.argmin(good))][0]} holds a number that no measurement gives"


def _is_far(blob: bytes) -> bool:
    values = np.abs(np.frombuffer(blob, dtype="<f8"))
    return bool(np.fmax.reduce(values, initial=0.0) > _FARTHEST)


def _place_fault(row: Sequence[Any]) -> str:
    number, feature, _, first, last, n_frames = row[:6]
    if not 0 < number <= _MOST_NUMBER:
        return f"point number {number} is none that is given"
    if len(feature) > _LONGEST_NAME or len(row[14]) > _LONGEST_NAME:
        return f"a name of point {number} is too long"
    if not (0 <= first <= last <= _MOST_FRAME and 0 < n_frames <= _MOST_FRAMES):
        return f"point {number} is the mean of {n_frames} frames, from {first} to {last}"
    if (len(row[6]), len(row[7]), len(row[8]), len(row[10])) != _SIZES:
        return f"an array of point {number} has another size"
    return ""


@lru_cache(maxsize=64)
def _spots_bytes(shape: str) -> int:
    """Return the size of spots of a shape, bytes; -1 if invalid."""
    match = _SHAPE.fullmatch(shape)
    return -1 if match is None else int(match[1]) * int(match[2]) * 16


def _is_time(text: str) -> bool:
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return False
    # Far from both ends of the calendar, at which a change of the time zone fails.
    return found.tzinfo is not None and _FIRST_YEAR <= found.year <= _LAST_YEAR
