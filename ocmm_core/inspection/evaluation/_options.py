"""What a session accepts, and what it counts with."""

from __future__ import annotations

from dataclasses import dataclass, field

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.geometry import RigidTransform
from ocmm_core.measuring import Climate, PointOptions
from ocmm_core.tracking import Method, ReferenceBody


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What the session accepts.

    Attributes
    ----------
    point
        What a touch must be like.
    max_form
        A feature whose points scatter by more than this, mm, has a point that belongs elsewhere:
        it gives no result.
    climate
        Temperatures of probe and part, and what is compensated for them.
    contact
        What the hand's force does to the probe; None where its design is not known.
    reference
        Reference body to which all points are given; None without one.
    near
        Motion from the world to the nominals of the plan, roughly, as a part before this one
        stood; only for guidance. None where nothing is known.
    method
        How the poses of the touches are computed; results of ``"thesis"`` prove nothing.
    """

    point: PointOptions = field(default_factory=PointOptions)
    max_form: float = 0.5
    climate: Climate = field(default_factory=Climate)
    contact: ContactForce | None = None
    reference: ReferenceBody | None = None
    near: RigidTransform | None = None
    method: Method = "gauss-newton"
