"""What an inspector asks of the job: by keys, by lists, and from the sheets."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from ocmm_core.errors import MeasuringError
from ocmm_core.export.report import ReportData
from ocmm_core.inspection.evaluation import Probing
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import METHODS
from ocmm_core.station import MeasuringStation
from ocmm_core.surroundings import TypedRoom
from ocmm_gui.bridge._commands import CommandQueue, ShownJob
from ocmm_gui.kit import active_feature
from ocmm_gui.work import Failed


class JobCommands:
    """Commands that mean the feature that is shown or active, or the job as a whole.

    Parameters
    ----------
    queue
        Carries them out.
    shown
        Says which feature that is.
    """

    def __init__(self, queue: CommandQueue, shown: ShownJob) -> None:
        self._queue, self._shown = queue, shown

    def take(self) -> None:
        """Take a point now."""
        self._queue.take()

    def note_room(self, typed: TypedRoom, done: Callable[[], None]) -> None:
        """Keep in the job what was read off in the room now."""
        who = self._shown.job.header.operator
        self._queue.change(lambda session: session.conditions.note_room(typed, who), done)

    def undo(self) -> None:
        """Take the last point back."""
        self._queue.change(lambda session: session.steps.undo())

    def redo(self) -> None:
        """Do again what was undone last."""
        self._queue.change(lambda session: session.steps.redo())

    def finish(self) -> None:
        """Accept the active feature and go to the next."""
        self._queue.change(lambda session: session.steps.finish())

    def flip(self) -> None:
        """Flip the compensation side of the last point."""
        self._queue.change(lambda session: session.points.flip())

    def skip(self) -> None:
        """Leave out the feature that is looked at, or the active one."""
        name = self._shown.job.looked_at
        self._queue.change(lambda session: session.steps.skip(name))

    def repeat(self) -> None:
        """Measure the active feature anew, or the last one where none is active."""
        shown = self._shown.job.shown
        if shown is not None:
            self._queue.change(lambda session: session.steps.repeat(shown.name))

    def reopen(self) -> None:
        """Let the feature that is shown take points again, one that is done or skipped."""
        shown = self._shown.job.shown
        if shown is not None:
            self._queue.change(lambda session: session.steps.reopen(shown.name))

    def toggle_order(self) -> None:
        """Probe in any order, or in that of the plan again."""
        order: Probing = "plan" if self._shown.job.probing == "any" else "any"
        self._queue.change(lambda session: session.steps.set_order(order))

    def toggle_pause(self) -> None:
        """Take no points any more, or go on."""
        if self._shown.job.paused:
            self._queue.change(lambda session: session.pausing.resume())
        else:
            self._queue.change(lambda session: session.pausing.pause())

    def next_side(self) -> None:
        """Find the side of the material of the active feature in the next way that suits it."""
        name, feature = self._shown.job.active, active_feature(self._shown.job)
        if feature is None:
            return
        start = METHODS.index(feature.compensation) + 1
        allowed = (*METHODS[start:], *METHODS[:start])

        def turn(session: InspectionSession) -> None:
            for method in allowed:
                # What says nothing about this shape is passed over.
                with contextlib.suppress(MeasuringError):
                    session.steps.set_compensation(method, name)
                    return

        self._queue.change(turn)


class ChoiceCommands:
    """Choose a feature, and take single points out of it.

    Parameters
    ----------
    queue
        Carries the commands out.
    shown
        Keeps what was chosen until it is shown.
    """

    def __init__(self, queue: CommandQueue, shown: ShownJob) -> None:
        self._queue, self._shown = queue, shown

    def select(self, feature: str) -> None:
        """Look at a feature of the plan; one that is open gets the next touch."""
        self._shown.selected = feature
        self._queue.change(lambda session: session.steps.select(feature))

    def select_neighbour(self, step: int) -> None:
        """Look at the feature ``step`` places after the one that is shown.

        Behind the last one of a job that is done stands the verdict on the part.
        """
        job = self._shown.job
        names = [feature.name for feature in job.features]
        # Keys that come faster than the job is evaluated count as well.
        shown = self._shown.selected or job.looked_at or job.active
        if not names:
            return
        place = (names.index(shown) if shown in names else len(names)) + step
        if place >= len(names) and not job.active:
            self.select("")
        else:
            self.select(names[min(max(place, 0), len(names) - 1)])

    def delete_point(self, number: int, reason: str) -> None:
        """Take a point out of its feature."""
        self._queue.change(lambda session: session.points.delete_point(number, reason))

    def restore_point(self, number: int) -> None:
        """Put a deleted point back."""
        self._queue.change(lambda session: session.points.restore_point(number))


class ResultCommands:
    """Ask for results: computed again, accepted, or as a report.

    Parameters
    ----------
    queue
        Carries the commands out.
    """

    def __init__(self, station: MeasuringStation, queue: CommandQueue) -> None:
        self._station, self._queue = station, queue

    def refit(self) -> None:
        """Compute everything again from the raw observations."""
        self._queue.change(lambda session: session.refit())

    def accept_alignment(self, words: str, done: Callable[[], None]) -> None:
        """Write into the job that the alignment was accepted; ``done`` is told when it is."""
        self._queue.change(lambda session: session.accept_alignment(words), done)

    def report(self, done: Callable[[ReportData], None], failed: Failed) -> None:
        """Give everything that a report can say about the job as it stands."""
        self._queue.ask(self._station.reports.data, done, failed)
