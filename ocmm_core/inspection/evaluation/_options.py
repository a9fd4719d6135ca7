"""Options of a session, and its limits as stored in the job file.

Not in the plan: other limits give other results. A job is recalculated with the last ones; files of
older versions lack the event and have the default limits.
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

FOR_COMPARISON = (
    "Poses computed with the method of the thesis, for comparison: U does not apply to this method."
)
"""Why a job with such points proves nothing."""


@dataclass(frozen=True, slots=True)
class SessionOptions:
    point: PointOptions = field(default_factory=PointOptions)
    max_form: float = 0.5
    """mm: a feature whose points scatter by more has a misassigned point and gives no result."""
    climate: Climate = field(default_factory=Climate)
    """Temperatures of probe and part, and their compensation."""
    contact: ContactForce | None = None
    """Effect of the probing force; None if the design of the probe is unknown."""
    reference: ReferenceBody | None = None
    """Reference body of all points; None without one."""
    near: RigidTransform | None = None
    """Rough motion from the world to the nominals, from a previous part; guidance only."""
    method: Method = "gauss-newton"
    """Computation of the poses of touches; results of ``"thesis"`` prove nothing."""


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Limits as stored; lengths in mm, times in s."""

    max_form: float
    window_s: float
    still_mm: float
    min_share: float
    approach_mm: float
    max_uncertainty: float
    method: Method
    untimed_mm: float = 0.0


def limits_text(options: SessionOptions) -> str:
    written = _Written(max_form=options.max_form, **asdict(options.point), method=options.method)
    return msgspec.json.encode(written).decode()


def with_stored_limits(options: SessionOptions, events: Sequence[JobEvent]) -> SessionOptions:
    """Return options with the last stored limits, if any; InputError if unreadable."""
    texts = [event.text for event in events if event.kind == LIMITS_EVENT]
    if not texts:
        return options
    fields = msgspec.structs.asdict(_read(texts[-1]))
    max_form, method = fields.pop("max_form"), fields.pop("method")
    return replace(options, point=PointOptions(**fields), max_form=max_form, method=method)


def methods_used(events: Sequence[JobEvent]) -> tuple[Method, ...]:
    """Return the methods of a job's poses, each once; a resumed job may mix them."""
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
