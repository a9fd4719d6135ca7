"""What a session accepts and counts with, and its limits as the job file keeps them.

Limits are not in the plan: two programs with other limits would say other things about the same
points. What was in force last is what a job is computed anew with. Files of older versions lack
the event; they were measured with the limits that are the default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

import msgspec

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.documents import decode_json
from ocmm_core.errors import InputError
from ocmm_core.geometry import RigidTransform
from ocmm_core.measuring import Climate, PointOptions
from ocmm_core.storage import JobEvent
from ocmm_core.tracking import Method, ReferenceBody

LIMITS_EVENT = "limits"
"""Kind of the event of the job file."""

FOR_COMPARISON = (
    "Poses computed with the method of the thesis, for comparison: U does not apply to this method."
)
"""Why a job with such points proves nothing."""


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What the session accepts."""

    point: PointOptions = field(default_factory=PointOptions)
    """What a touch must be like."""
    max_form: float = 0.5
    """A feature whose points scatter by more than this, mm, has a point that belongs elsewhere: it
    gives no result."""
    climate: Climate = field(default_factory=Climate)
    """Temperatures of probe and part, and what is compensated for them."""
    contact: ContactForce | None = None
    """What the hand's force does to the probe; None where its design is not known."""
    reference: ReferenceBody | None = None
    """Reference body to which all points are given; None without one."""
    near: RigidTransform | None = None
    """Motion from the world to the nominals of the plan, roughly, as a part before this one stood;
    only for guidance. None where nothing is known."""
    method: Method = "gauss-newton"
    """How the poses of the touches are computed; results of ``"thesis"`` prove nothing."""


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Limits as they are written down; lengths in mm, times in s."""

    max_form: float
    window_s: float
    still_mm: float
    min_share: float
    approach_mm: float
    max_uncertainty: float
    method: Method
    untimed_mm: float = 0.0


def limits_text(options: SessionOptions) -> str:
    """Return the text of the event."""
    written = _Written(max_form=options.max_form, **asdict(options.point), method=options.method)
    return msgspec.json.encode(written).decode()


def with_stored_limits(options: SessionOptions, events: Sequence[JobEvent]) -> SessionOptions:
    """Return options with the limits that were in force last; as they are where none is stored.

    Raises
    ------
    InputError
        The record cannot be read.
    """
    texts = [event.text for event in events if event.kind == LIMITS_EVENT]
    if not texts:
        return options
    written = _read(texts[-1])
    fields = msgspec.structs.asdict(written)
    max_form, method = fields.pop("max_form"), fields.pop("method")
    return replace(options, point=PointOptions(**fields), max_form=max_form, method=method)


def methods_used(events: Sequence[JobEvent]) -> tuple[Method, ...]:
    """Return the ways in which poses of a job were computed, without repeats; InputError as above.

    Points of one job may differ in it: it is gone on with as somebody likes.
    """
    found = [_read(event.text).method for event in events if event.kind == LIMITS_EVENT]
    return tuple(dict.fromkeys(found)) or (SessionOptions().method,)


def _read(text: str) -> _Written:
    try:
        return decode_json(text, _Written)
    except msgspec.MsgspecError as error:
        raise InputError(
            "session.limits",
            f"The job's record of its limits cannot be read: {error}.",
            "Open the job with the program version that wrote it.",
        ) from error
