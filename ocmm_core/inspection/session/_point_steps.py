"""Steps of the inspector on single points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.session._ledger import JobLedger

_LONGEST_REASON = 200


class PointSteps:
    """Steps on single points: durable, with undo."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def flip(self, number: int | None = None) -> None:
        """Flip the compensation of a point, or of the last one; MeasuringError if unknown."""
        ledger = self._ledger
        with ledger.lock:
            if not ledger.points.counting:
                raise MeasuringError("session.no_point", "No points taken yet.", "Take one first.")
            old = ledger.points.counting[-1] if number is None else ledger.points.point(number)
            new = replace(
                old,
                number=ledger.points.next_number(),
                direction=-old.direction,
                approach="flipped",
            )
            ledger.log.flip(old, new)
            ledger.changed()

    def delete_point(self, number: int, reason: str) -> None:
        """Delete a point for a reason; its observation stays in the job file.

        The feature takes points again if it has fewer than planned; `finish` accepts it with fewer.
        MeasuringError if the point is unknown, or without a reason.
        """
        self.delete_points([number], reason)

    def delete_points(self, numbers: Sequence[int], reason: str) -> None:
        """Take points of one feature out as `delete_point`, in one step."""
        ledger, line = self._ledger, _checked_reason(reason)
        with ledger.lock:
            features = {ledger.points.point(number).feature for number in numbers}
            if len(features) != 1:
                raise ValueError(features)
            number = ", ".join(map(str, numbers))
            ledger.did(
                f"deletion of point {number}",
                ledger.settled(features.pop(), -len(numbers)),
                annul=dict.fromkeys(numbers, line),
            )

    def restore_point(self, number: int) -> None:
        """Restore a deleted point with a new number; MeasuringError if it is not deleted."""
        ledger = self._ledger
        with ledger.lock:
            feature = ledger.points.taken_out(number).feature
            ledger.did(f"restore of point {number}", ledger.settled(feature, 1), restore=[number])


def _checked_reason(reason: str) -> str:
    line = " ".join(reason.split())[:_LONGEST_REASON]
    if not line or not line.isprintable():
        raise MeasuringError(
            "session.no_reason",
            "Deleting a point needs a reason.",
            "State briefly why it does not belong to the feature.",
        )
    return line
