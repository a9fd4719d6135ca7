"""The part frame that the points of a job show."""

from __future__ import annotations

from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.evaluation import SessionOptions, measured_frame
from ocmm_core.inspection.session._ledger import JobLedger


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
        ledger = self._ledger
        with ledger.lock:
            points = list(ledger.points.counting)
        return measured_frame(ledger.plan, points, self._options, ledger.cache)
