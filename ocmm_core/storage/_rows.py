"""Measured points and the head of a job as rows of the job file, bit for bit.

Rows are checked before any computation: could this program have stored them? An audit can be forged
with its file. Faults are the end of one sentence.
"""

from __future__ import annotations

import math
import re
import uuid
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from ocmm_core.build import build_version
from ocmm_core.documents import decode_json, read_text, text_digest
from ocmm_core.errors import StorageError
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage._audit import Value, now_utc

T = TypeVar("T")


def event_value(kind: str, text: str, form: type[T]) -> T:
    """Return the value in the text of an event; StorageError if malformed."""
    try:
        return decode_json(text, form)
    except msgspec.MsgspecError as error:
        raise bad_event(kind, str(error)) from error


def bad_event(kind: str, why: str) -> StorageError:
    return StorageError(
        "job.event",
        f"The event '{kind}' in the job cannot be read: {why}.",
        "Open the job with the program version that wrote it.",
    )


@dataclass(frozen=True, slots=True)
class JobHead:
    """Head of a job; written once."""

    job_uuid: str
    created_utc: str
    """ISO 8601 text."""
    software_version: str
    operator: str
    part: str
    serial: str
    plan_text: str
    rig_text: str
    probe_text: str
    """Complete documents or records: the job can be recomputed from its file."""

    @property
    def plan_identity(self) -> str:
        """Return the SHA-256 of the plan document."""
        return text_digest(self.plan_text)

    @property
    def rig_identity(self) -> str:
        """Return the SHA-256 of the rig document, equal to ``Rig.identity``."""
        return text_digest(self.rig_text)

    @property
    def probe_identity(self) -> str:
        """Return the SHA-256 of ``probe_text``, equal to ``ProbeBody.identity``."""
        return text_digest(self.probe_text)


@dataclass(frozen=True, slots=True)
class JobEvent:
    """Event during the job: ISO 8601 time, kind and a sentence."""

    time_utc: str
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class JobReference:
    """Reference body of a job and its spots when the job began; written once."""

    text: str
    spots: Float
    """(C, R, 2), px: mean spots by LED number, NaN where not seen."""
    n_frames: int

    @property
    def identity(self) -> str:
        """Return the SHA-256 of the document, equal to ``ReferenceBody.identity``."""
        return text_digest(self.text)


def make_head(
    *, plan: Path, rig: Path, probe: Path, operator: str, part: str, serial: str
) -> JobHead:
    """Return the head of a new job with current documents and UUID; InputError: unreadable."""
    return JobHead(
        job_uuid=str(uuid.uuid4()),
        created_utc=now_utc(),
        software_version=build_version(),
        operator=operator,
        part=part,
        serial=serial,
        plan_text=read_text(plan),
        rig_text=read_text(rig),
        probe_text=read_text(probe),
    )


def row_from_head(head: JobHead) -> tuple[Value, ...]:
    return (
        1, head.job_uuid, head.created_utc, head.software_version, head.operator, head.part,
        head.serial, head.plan_text, head.plan_identity, head.rig_text, head.rig_identity,
        head.probe_text, head.probe_identity,
    )  # fmt: skip


def head_from_row(row: Sequence[Any]) -> JobHead:
    (_, job_uuid, created_utc, software_version, operator, part, serial,
     plan_text, _, rig_text, _, probe_text, _) = row  # fmt: skip
    return JobHead(
        job_uuid, created_utc, software_version, operator, part, serial,
        plan_text, rig_text, probe_text,
    )  # fmt: skip


def row_from_reference(reference: JobReference) -> tuple[Value, ...]:
    return (
        1, reference.text, reference.identity, *_spots(reference.spots), int(reference.n_frames),
    )  # fmt: skip


def reference_from_row(row: Sequence[Any]) -> JobReference:
    _, text, _, shape, spots, n_frames = row
    return JobReference(text, spots_from(shape, spots), n_frames)


def reference_row_from_point(point: MeasuredPoint) -> tuple[Value, ...] | None:
    """Return the row of table ``reference_observation``; None without a reference body."""
    if point.reference_spots is None:
        return None
    return (int(point.number), *_spots(point.reference_spots))


def row_from_point(point: MeasuredPoint) -> tuple[Value, ...]:
    """Return the row of ``observation``; StorageError if a number is not finite."""
    for field in ("time_s", "tip_radius", "chi2_per_dof"):
        if not math.isfinite(getattr(point, field)):
            raise StorageError(
                "job.point",
                f"Point {point.number} has {field} = {getattr(point, field)}.",
                "Take the point again.",
            )
    # SQLite keeps no sign of zero in a REAL column: adding zero drops it before the digest.
    return (
        int(point.number), point.feature, float(point.time_s) + 0.0, int(point.first_frame),
        int(point.last_frame), int(point.n_frames), _blob(point.tip_world),
        _blob(point.random_covariance), _blob(point.direction), float(point.tip_radius) + 0.0,
        _blob(point.rotation_world_from_probe), *_spots(point.spots),
        float(point.chi2_per_dof) + 0.0, point.approach,
    )  # fmt: skip


def point_from_row(row: Sequence[Any]) -> MeasuredPoint:
    (number, feature, time_s, first, last, n, tip, covariance, direction, radius, rotation,
     shape, spots, chi2, approach) = row  # fmt: skip
    return MeasuredPoint(
        number=number,
        feature=feature,
        time_s=time_s,
        first_frame=first,
        last_frame=last,
        n_frames=n,
        tip_world=_array(tip, (3,)),
        random_covariance=_array(covariance, (3, 3)),
        direction=_array(direction, (3,)),
        tip_radius=radius,
        rotation_world_from_probe=_array(rotation, (3, 3)),
        spots=spots_from(shape, spots),
        chi2_per_dof=chi2,
        approach=approach,
    )


def spots_from(shape: str, blob: bytes) -> Float:
    """Return the array of the columns ``spots_shape`` and ``spots``."""
    return _array(blob, tuple(int(part) for part in shape.split(",")))


def _spots(spots: Float) -> tuple[str, bytes]:
    return ",".join(str(n) for n in spots.shape), _blob(spots)


def _blob(array: Float) -> bytes:
    return np.ascontiguousarray(array, dtype="<f8").tobytes()


def _array(blob: bytes, shape: tuple[int, ...]) -> Float:
    # frombuffer gives a read-only view that keeps the blob alive.
    return np.frombuffer(blob, dtype="<f8").astype(np.float64).reshape(shape)


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
