"""Measured points and the head of a job as rows of the job file, bit for bit."""

from __future__ import annotations

import hashlib
import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from ocmm_core import __version__
from ocmm_core.documents import decode_json, read_text
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
        return _sha256(self.plan_text)

    @property
    def rig_identity(self) -> str:
        """Return the SHA-256 of the rig document, equal to ``Rig.identity``."""
        return _sha256(self.rig_text)

    @property
    def probe_identity(self) -> str:
        """Return the SHA-256 of ``probe_text``, equal to ``ProbeBody.identity``."""
        return _sha256(self.probe_text)


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
        return _sha256(self.text)


def make_head(
    *, plan: Path, rig: Path, probe: Path, operator: str, part: str, serial: str
) -> JobHead:
    """Return the head of a new job with current documents and UUID; InputError: unreadable."""
    return JobHead(
        job_uuid=str(uuid.uuid4()),
        created_utc=now_utc(),
        software_version=__version__,
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


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()
