"""What the inspector did, so that it can be taken back and done again."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.inspection.evaluation import Progress
from ocmm_core.inspection.session._job_points import Change


@dataclass(frozen=True, slots=True)
class UndoStep:
    """One step of the inspector.

    Attributes
    ----------
    words
        What it was, for the button that takes it back.
    change
        Points that it added and took out.
    before, after
        Where the job stood.
    """

    words: str
    change: Change
    before: Progress
    after: Progress

    def undone_by(self, change: Change) -> UndoStep:
        """Return the deed that this change of points was: it takes this one back."""
        return UndoStep(self.words, change, self.after, self.before)


class UndoHistory:
    """The steps of a job, newest last, and those that were taken back."""

    def __init__(self) -> None:
        self._done: list[UndoStep] = []
        self._undone: list[UndoStep] = []

    @property
    def last(self) -> UndoStep | None:
        """Return the deed that an undo would take back."""
        return self._done[-1] if self._done else None

    @property
    def last_undone(self) -> UndoStep | None:
        """Return the undo that a redo would take back."""
        return self._undone[-1] if self._undone else None

    def did(self, step: UndoStep) -> None:
        """Remember a new step; what was undone before it cannot be done again."""
        self._done.append(step)
        self._undone.clear()

    def undid(self, reverse: UndoStep) -> None:
        """Remember that the last step was taken back by ``reverse``."""
        if self._done:
            self._done.pop()
        self._undone.append(reverse)

    def redid(self, reverse: UndoStep) -> None:
        """Remember that the last undo was taken back by ``reverse``."""
        self._undone.pop()
        self._done.append(reverse)
