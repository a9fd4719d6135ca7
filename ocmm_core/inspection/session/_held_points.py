"""Points that do not count while what they were taken with is in doubt."""

from __future__ import annotations

from collections.abc import Iterable

from ocmm_core.inspection.evaluation import HoldReason
from ocmm_core.inspection.session._ledger import JobLedger


class HeldPoints:
    """Hold points back, and release them.

    Parameters
    ----------
    ledger
        What they change.
    """

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def hold_back(self, since_s: float | None, reason: str) -> list[int]:
        """Hold back the points that were taken since a moment of this run, and return them.

        Parameters
        ----------
        since_s
            Bus time, s; None for all points of this run.
        reason
            A sentence.

        Raises
        ------
        StorageError
            It could not be made durable; the points are held back until the program ends.
        """
        with self._ledger.lock:
            numbers = self._ledger.points.taken_since(since_s)
            return self.hold_back_points(numbers, reason, HoldReason.CAMERAS)

    def hold_back_points(
        self, numbers: Iterable[int], reason: str, hold_reason: HoldReason
    ) -> list[int]:
        """Hold back points, and return those that were not yet; StorageError as `hold_back`."""
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.hold_back(numbers, reason, hold_reason)

    def held_for(self, hold_reason: HoldReason) -> dict[int, str]:
        """Return the points that count and are held back for a ward, and why."""
        with self._ledger.lock:
            held = self._ledger.points.held[hold_reason]
            return {
                p.number: held[p.number] for p in self._ledger.points.counting if p.number in held
            }

    def release(self, reason: str, hold_reason: HoldReason = HoldReason.CAMERAS) -> list[int]:
        """Let points count again that were held back, and return them.

        What was held back for the cameras in an earlier run stays so.

        Raises
        ------
        StorageError
            It could not be made durable; they stay held back.
        """
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.release(reason, hold_reason)

    def release_points(
        self, numbers: Iterable[int], reason: str, hold_reason: HoldReason
    ) -> list[int]:
        """Let points count again, and return those that were held; StorageError as `release`."""
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.release_points(numbers, reason, hold_reason)
