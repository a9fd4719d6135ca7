"""The job of a running station: what it shows, and what an inspector does with it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import JobView, StatusWord
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.seals import ReleaseState
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._frame_loop import FrameLoop
from ocmm_core.station._looks import Looks
from ocmm_core.station._open_job import CurrentJob
from ocmm_core.station._touches import refuse
from ocmm_core.storage import JobStep

_EVALUATION = "The evaluation"


class StationJob:
    """Show and change the job that is measured now; for any thread.

    Parameters
    ----------
    current
        Which job that is.
    looks
        Say whether a point can be taken now.
    frames
        Takes it.
    faults, events
        Told what fails, and what changes.
    """

    def __init__(
        self,
        current: CurrentJob,
        looks: Looks,
        frames: FrameLoop,
        faults: StationFaults,
        events: StationEvents,
    ) -> None:
        self._current, self._looks, self._frames = current, looks, frames
        self._faults, self._events = faults, events

    @property
    def path(self) -> Path:
        """Return where the job file is."""
        return self._current.now.file.path

    @property
    def plan(self) -> Plan:
        """Return what is measured now."""
        return self._current.now.use.plan

    @property
    def plan_identity(self) -> str:
        """Return the SHA-256 of the document that is measured by now."""
        return self._current.now.file.head.plan_identity

    @property
    def release(self) -> ReleaseState:
        """Return the state of the release of the plan, when the job was started."""
        return self._current.now.release

    @property
    def plan_file(self) -> Path | None:
        """Return where the plan is, with its pictures beside it; None where not known."""
        return self._current.now.use.file

    def view(self) -> JobView:
        """Return the job as it stands.

        Raises
        ------
        OcmmError
            It cannot be evaluated: the station is FAILED then, and what was told before is void.
        """
        fault = self._faults.measuring
        if fault is not None and fault.part == _EVALUATION:
            raise fault.error
        try:
            return self._current.now.session.view
        except Exception as error:
            if self._current.ended:
                # A job that was closed meanwhile has nothing to show any more.
                raise
            raise self._faults.fail(error, _EVALUATION) from error

    def missing(self) -> list[tuple[str, int]]:
        """Return the features that are not done and how many points each still needs."""
        return self._current.now.session.steps.missing()

    def explanations(self) -> tuple[Explanation, ...]:
        """Return why results are not CONFORM, and what to do; see `InspectionSession`."""
        return self._current.now.session.explanations()

    @property
    def lost(self) -> StorageError | None:
        """Return why the job is not on the disk under its name; also after the station closed."""
        return self._current.now.file.check_name()

    def stored(self) -> tuple[str, list[MeasuredPoint]]:
        """Return the name of the job that is measured, and its durable points that count."""
        file = self._current.now.file
        return file.path.stem, file.points()

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return the job that is measured, and what was stored in it behind an audit row.

        From its beginning where ``job`` is another one. Raises StorageError as `JobFile.steps`.
        """
        file = self._current.now.file
        return file.path, file.steps(after if file.path == job else 0)

    def take(self) -> None:
        """Take a point now; the answer comes by signal.

        Where the machine is not ready the answer is a refusal, and nothing is taken later.
        """
        live = self._looks.live()
        if live.status not in (StatusWord.NOT_READY, StatusWord.FAILED):
            self._frames.arm()
            return
        remedy = "Touch again when READY is shown."
        refuse(
            self._current.now.session,
            Refusal(RefusalCode.NOT_READY, live.reason, remedy, live.time_s),
            self._events,
        )

    def change(self, verb: Callable[[InspectionSession], object]) -> None:
        """Let the session do something, such as ``session.steps.skip()``, and tell of it.

        What nobody foresaw leaves the job in doubt: the station is FAILED then.

        Raises
        ------
        OcmmError
            What the session raises; nothing is told then.
        """
        try:
            verb(self._current.now.session)
        except OcmmError:
            raise
        except Exception as error:
            # The file may know of a step that the memory does not: only a new start reads it.
            raise self._faults.fail(error, "The change of the job", tell=False) from error
        self._events.emit(self._events.changed)
