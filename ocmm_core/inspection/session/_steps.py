"""Steps of the inspector on a running job and on single points: durable, with undo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.inspection.evaluation import PAUSED, RESUMED, Probing
from ocmm_core.inspection.session._assignment import chosen_methods
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import PATH


class JobSteps:
    """Steps on the job as a whole, and on its features."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def undo(self) -> None:
        """Undo the last step, also one of an earlier run; errors as `StepLog.undo`."""
        with self._ledger.lock:
            self._ledger.log.undo()
            self._ledger.changed()

    def redo(self) -> None:
        """Redo the last undone step; errors as `StepLog.redo`."""
        with self._ledger.lock:
            self._ledger.log.redo()
            self._ledger.changed()

    def skip(self, name: str = "") -> None:
        """Skip a feature, or the active one; dependents are not measured. Or MeasuringError."""
        ledger = self._ledger
        with ledger.lock:
            name = ledger.known(name or ledger.require_active())
            ledger.did(
                f"skip of {name}", ledger.progress.left_out(name), events=[("skipped", name)]
            )

    def repeat(self, name: str = "") -> None:
        """Remeasure a feature, or the active one: delete its points; MeasuringError if none."""
        ledger = self._ledger
        with ledger.lock:
            name = ledger.known(name or ledger.require_active())
            numbers = [point.number for point in ledger.points.of_feature(name)]
            ledger.did(
                f"repeat of {name}",
                ledger.progress.opened(name),
                annul=dict.fromkeys(numbers, f"{name} is repeated"),
                events=[("repeated", name)],
            )
            ledger.selected = name

    def finish(self) -> None:
        """Accept the active feature with the points it has and go to the next one.

        MeasuringError if none is active, or its shape needs more points.
        """
        ledger = self._ledger
        with ledger.lock:
            feature = ledger.plan.feature(ledger.require_active())
            minimum, count = MINIMUM_POINTS[feature.shape], ledger.points.count(feature.name)
            if count < minimum:
                raise MeasuringError(
                    "session.too_few",
                    f"{feature.name} has {count} of the {minimum} points that a "
                    f"{feature.shape.value.lower()} needs.",
                    f"Take {minimum - count} more.",
                )
            ledger.did(
                f"finish of {feature.name}",
                ledger.progress.finished(feature.name),
                events=[("finished", f"{feature.name} with {count} points")],
            )

    def select(self, name: str) -> None:
        """Review a feature, or the active one if empty; if it still takes points, the next touch.

        Done or skipped, it stays so, with verdicts; see `reopen`. MeasuringError if unknown.
        """
        ledger = self._ledger
        with ledger.lock:
            progress = ledger.progress
            if name and ledger.known(name) not in progress.done | progress.skipped:
                if name != progress.active:
                    ledger.stand(replace(progress, active=name))
                ledger.selected, ledger.looked_at = name, ""
            else:
                ledger.looked_at = name

    def reopen(self, name: str = "") -> None:
        """Let a feature that is done or skipped, or the one under review, take points again.

        MeasuringError if unknown, none is under review, or it takes points already.
        """
        ledger = self._ledger
        with ledger.lock:
            name = ledger.known(name or ledger.looked_at or ledger.require_active())
            if name not in ledger.progress.done | ledger.progress.skipped:
                raise MeasuringError("session.open", f"{name} is open for points.", "Touch it.")
            ledger.did(
                f"reopen of {name}", ledger.progress.opened(name), events=[("reopened", name)]
            )
            ledger.selected = name

    def set_order(self, probing: Probing) -> None:
        """Probe in plan order or, once the part frame is known, in any, with recognition."""
        with self._ledger.lock:
            self._ledger.stand(replace(self._ledger.progress, probing=probing))

    def missing(self) -> list[tuple[str, int]]:
        """Return the open features with the number of missing points."""
        ledger = self._ledger
        with ledger.lock:
            settled = ledger.progress.done | ledger.progress.skipped
            return [
                (feature.name, max(feature.points - ledger.points.count(feature.name), 0))
                for feature in ledger.plan.features
                if feature.name not in settled
            ]

    def set_compensation(self, method: str, name: str = "") -> None:
        """Set the side detection of a feature, or of all that allow it (empty name).

        `method`: one of `measuring.compensation.METHODS`. MeasuringError if unknown, or unsuitable.
        """
        ledger = self._ledger
        with ledger.lock:
            known = ledger.known(name) if name else ""
            chosen = chosen_methods(ledger.plan, ledger.progress, method, known)
            ledger.stand(replace(ledger.progress, methods=chosen))


class Pausing:
    """Pause and resume a job; persists across restarts."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def pause(self) -> None:
        """Refuse touches until `resume`, also after a restart."""
        ledger = self._ledger
        with ledger.lock:
            if not ledger.paused:
                ledger.job.append_event(PAUSED, "by the operator")
                ledger.paused, ledger.view = True, None

    def resume(self) -> None:
        ledger = self._ledger
        with ledger.lock:
            if ledger.paused:
                ledger.job.append_event(RESUMED, "by the operator")
                ledger.paused, ledger.view = False, None

    def go_on(self, operator: str) -> None:
        """Resume an earlier job, and note the operator."""
        with self._ledger.lock:
            self._ledger.job.append_event("gone on", f"by {operator}")
            self.resume()

    @property
    def paused(self) -> bool:
        return self._ledger.paused


_LONGEST_REASON = 200


class PointSteps:
    """Steps on single points: durable, with undo."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def flip(self, number: int | None = None) -> None:
        """Flip the compensation of a point, or of the last one.

        MeasuringError if unknown, or on a path: all its points are on one side.
        """
        ledger = self._ledger
        with ledger.lock:
            if not ledger.points.counting:
                raise MeasuringError("session.no_point", "No points taken yet.", "Take one first.")
            old = ledger.points.counting[-1] if number is None else ledger.points.point(number)
            if old.approach == PATH:
                raise MeasuringError(
                    "session.path_side",
                    f"Point {old.number} of {old.feature} is on a path, whose points have one "
                    "side.",
                    "Undo the path, move the ball away square to the surface and slide again.",
                )
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
