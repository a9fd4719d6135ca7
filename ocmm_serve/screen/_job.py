"""The job of a station for the second screen: evaluated after changes, and three actions on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import msgspec

from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.failure import contained
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import JobView, withdrawn
from ocmm_core.station import MeasuringStation
from ocmm_core.wording import ENGLISH, Speech
from ocmm_serve.screen._snapshot import job_of


class ScreenCall(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Message of a page: first its ``token`` and ``language``, then what it has ``seen``.

    ``do``: an action on the job as displayed; it is answered under its ``id``.
    """

    token: str = ""
    language: str = ENGLISH
    seen: int = 0
    do: str = ""
    id: int = 0
    job: str = ""
    sequence: int = 0


@dataclass(frozen=True, slots=True)
class ScreenedJob:
    """A job after its change `sequence`."""

    sequence: int
    view: JobView
    explanations: tuple[Explanation, ...]


class JobOnScreen:
    """Count the changes of a job, evaluate it, and act on it; each method on one thread."""

    def __init__(self, station: MeasuringStation) -> None:
        self._station = station
        self._count = itertools.count(1)
        self._encoded: dict[tuple[int, str], msgspec.Raw] = {}
        self.changes = 0
        self.evaluated: ScreenedJob | None = None

    @property
    def is_current(self) -> bool:
        """Return whether no change is newer than the evaluation."""
        return self.evaluated is not None and self.evaluated.sequence == self.changes

    def note_change(self) -> None:
        self.changes = next(self._count)

    def evaluate(self) -> None:
        """Evaluate the job; takes up to some seconds."""
        # Read first: the view fetched next contains everything up to this change.
        sequence, known = self.changes, self.evaluated
        try:
            view, explanations = self._station.job.view(), self._station.job.explanations()
        except Exception as error:
            told = contained(error, "The evaluation for the second screen")
            if known is None:
                return
            # Otherwise the previous verdicts would remain.
            view, explanations = withdrawn(known.view, f"{told.what} {told.remedy}"), ()
        self.evaluated = ScreenedJob(sequence, view, explanations)

    def encoded(self, job: ScreenedJob, speech: Speech) -> msgspec.Raw:
        """Return a job in a language, composed once for all its readers."""
        key = (job.sequence, speech.language)
        if key not in self._encoded:
            self._encoded = {one: raw for one, raw in self._encoded.items() if one[0] == key[0]}
            made = job_of(job.view, job.explanations, job.sequence, speech)
            self._encoded[key] = msgspec.Raw(msgspec.json.encode(made))
        return self._encoded[key]

    def act(self, call: ScreenCall) -> None:
        """Carry out an action on the job as it was displayed; OcmmError."""
        job = self._station.job
        if call.do not in ("take", "undo", "finish"):
            raise InputError(
                "screen.action", "The page asked for an unknown action.", "Load the page again."
            )
        # A point is added to any state of the job; the others mean the state that was displayed.
        changed = call.do != "take" and call.sequence != self.changes
        if changed or job.path.stem != call.job:
            raise MeasuringError(
                "screen.outdated",
                "The job has changed since this page showed it.",
                "Look at the page, then press again.",
            )
        if call.do == "take":
            job.record_point()
        elif call.do == "undo":
            job.change(lambda session: session.steps.undo())
        else:
            job.change(lambda session: session.steps.finish())
