"""The part frame that the points of a job show."""

from __future__ import annotations

from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.evaluation import SessionOptions, checked_features, frame_of
from ocmm_core.inspection.session._ledger import JobLedger
from ocmm_core.measuring import reported_points


class MeasuredFrame:
    """Compute the part frame whenever somebody asks.

    Parameters
    ----------
    ledger
        Holds the points.
    options
        Of the session.
    """

    def __init__(self, ledger: JobLedger, options: SessionOptions) -> None:
        self._ledger, self._options = ledger, options

    @property
    def T_part_from_world(self) -> RigidTransform | None:
        """Return the part frame, or None while its datums are not measured."""
        plan = self._ledger.plan
        with self._ledger.lock:
            points = reported_points(self._ledger.points.counting, self._options.climate.part)
            return frame_of(plan, checked_features(plan, points, self._options))
