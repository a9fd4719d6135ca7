"""A job opened read-only from its own file, computed anew and compared with what is stored.

Plan, cameras, probe, reference body and temperatures are in the job file, as they were. Nothing
else is needed: no document of this computer, no record, no clock. Only what became known later of
the tip and of the cameras is looked up where their history is on this computer
(`_tip_history`, `_camera_history`, together in `_known`). The file is read in memory
(`storage.read_job`): it can be write-protected, from another computer or an older version, or being
measured by another program.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.camera import Rig
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.archive._camera_history import settle_by_calibration
from ocmm_core.inspection.archive._known import KnownOfJob, known_alone, known_by_file, known_here
from ocmm_core.inspection.archive._points_in_doubt import History
from ocmm_core.inspection.archive._stored_documents import StoredDocuments, about
from ocmm_core.inspection.archive._tip_history import settle_by_history
from ocmm_core.inspection.evaluation import HoldReason, JobView, SessionOptions, methods_used
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session import InspectionSession, ReferenceUse
from ocmm_core.measuring import Climate, MeasuredPoint
from ocmm_core.named_file import FileIdentity
from ocmm_core.storage import ADOPTED, CLOCK, LEFT_OUT, RESCUED, JobEvent, JobFile, JobHead, JobSeal
from ocmm_core.tolerances.decisions import not_proven
from ocmm_core.tracking import ProbeBody, TipSensitivity

Tell = Callable[[str, float], None]
"""Told what is done next, and the share that is done."""

SAME_TIP_MM = 0.01
"""The stored mean tip of the frames and the tip of their mean spots differ by what is not
linear between them: 0.002 mm at most in the demonstration job."""


@dataclass(frozen=True, slots=True)
class ReopenedJob:
    """A job as its own file says it is; the file is closed again."""

    path: Path
    head: JobHead
    """What the job says about itself, with all documents."""
    plan: Plan
    rig: Rig
    body: ProbeBody
    """`plan`, `rig`, `body`: What was measured, and with what: by the file alone. ``body`` has the
    geometry of the temperatures of the job."""
    options: SessionOptions
    """Limits, temperatures, contact and reference body of the job."""
    view: JobView
    """The job, computed anew from the points; nothing in it is proven where there are doubts."""
    T_part_from_world: RigidTransform | None
    """The part frame; None while its datums are not measured."""
    points: tuple[MeasuredPoint, ...]
    """Not annulled, as they are stored: ball centres in the world of the job, as warm as it was."""
    sensitivities: tuple[TipSensitivity, ...]
    """Of each point, computed anew from its raw spots."""
    taken_back: tuple[tuple[MeasuredPoint, str], ...]
    """The points that were taken back, as they are stored, and why."""
    events: tuple[JobEvent, ...]
    taken_utc: dict[int, str]
    """`events`, `taken_utc`: What happened; when each point was stored, also annulled ones."""
    faults: tuple[str, ...]
    """One sentence for everything in which the file disagrees with its own audit."""
    differences: tuple[str, ...]
    """One sentence for every point that comes out otherwise than it is stored."""
    seal: JobSeal
    """How far the job goes, and who signed it."""
    history: History = field(default_factory=History)
    """What the history of the probe says of the job, where it is on this computer."""
    cameras: History = field(default_factory=History)
    """What the history of the calibration says of the job, or that it is not on this computer."""
    held: Mapping[HoldReason, Mapping[int, str]] = field(default_factory=dict)
    """The points that are held back, for what and why, by the file and by these histories."""
    recalled: tuple[str, ...] = ()
    """Why the archive of the shop holds the job back, as far as this computer has learned."""

    identity: FileIdentity | None = None
    """The file that was read; None if its bytes came from elsewhere."""
    left_out: str = ""
    """What of the file is in no complete step, as a sentence; empty if there is nothing."""

    @property
    def annulled(self) -> tuple[int, ...]:
        """Return the numbers of the points that were taken back."""
        return tuple(point.number for point, _ in self.taken_back)

    @property
    def climate(self) -> Climate:
        """Return the temperatures that the job was measured with."""
        return self.options.climate

    @property
    def contact(self) -> ContactForce | None:
        """Return what the hand's force did; None where the design of the probe is not known."""
        return self.options.contact

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return all that speaks against the job, in sentences."""
        tip = (*self.history.unread, *self.history.against)
        cameras = (*self.cameras.unread, *self.cameras.against)
        return (*self.faults, *self.differences, *self.recalled, *cameras, *tip)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return what a reader should know and what speaks against nothing, in sentences."""
        kinds = (ADOPTED, CLOCK, LEFT_OUT, RESCUED)
        told = (event.text for event in self.events if event.kind in kinds)
        return (*told, *self.renamed, *filter(None, (self.left_out, self.cameras.absent)))

    @property
    def renamed(self) -> tuple[str, ...]:
        """Return a sentence if the file does not have the name of the job."""
        if self.path.stem == self.view.job:
            return ()
        name = self.view.job
        return (f"The file was renamed to {self.path.name}: the job was measured as {name}.",)


def reopen_job(
    path: Path | str,
    probes: Path | None = None,
    tell: Tell = lambda what, share: None,
    calibrations: Path | None = None,
    *,
    alone: bool = False,
    known: KnownOfJob | None = None,
) -> ReopenedJob:
    """Open a job read-only and compute everything in it anew.

    Parameters
    ----------
    probes
        Where histories of probes are kept on this computer; None is the folder of this user.
    tell
        Told what is done next; whoever opens many points wants to see how far it is.
    calibrations
        Where histories of calibrations are kept on this computer; None is the folder of this user.
    alone
        By its file alone: no history is asked, and not how far this computer saw the job go.
    known
        What another computer knows of it (`known_here`): nothing is asked here.

    Raises
    ------
    StorageError
        The file is missing, no job file, newer than this program, damaged or cannot be read.
    InputError
        A document in the file cannot be used.
    OcmmError
        The points do not belong to the documents in the file.
    """
    path = Path(path)
    tell("Copying the job", 0.0)
    with JobFile.read(path) as job, _told_of(path):
        if known is None and alone:
            known = known_alone(job)
        elif known is None:
            known = known_here(job, path, probes, calibrations)
        return _reopened(path, job, known, tell)


def reopen_content(path: Path, file: bytes, known: KnownOfJob) -> ReopenedJob:
    """Return the job in the bytes of a file; errors as of `reopen_job`.

    Parameters
    ----------
    path
        What it is called: nothing is asked on this computer.
    """
    with JobFile.in_memory(path, file) as job, _told_of(path):
        return _reopened(path, job, known, lambda what, share: None)


def reopen_alone(path: Path, job: JobFile) -> ReopenedJob:
    """Return an open job by its file alone, called ``path``: the same on every computer.

    A good signature counts with any key. Readers decide which keys they trust.
    """
    with _told_of(path):
        return _reopened(path, job, known_by_file(job), lambda what, share: None)


@contextlib.contextmanager
def _told_of(path: Path) -> Iterator[None]:
    """Let an error say which job it is about."""
    try:
        yield
    except OcmmError as error:
        raise about(error, path) from error


def _reopened(path: Path, job: JobFile, known: KnownOfJob, tell: Tell) -> ReopenedJob:
    tell("Reading the documents", 0.05)
    head, events = job.head, job.events()
    stored = StoredDocuments(path, head)
    plan, rig = stored.plan(), stored.rig()
    body, options = stored.measured_with(events, job.reference())
    session = InspectionSession(plan, rig, body, job, options)
    points, taken_back = session.stored_points()
    use = ReferenceUse(rig, body, options.reference, job, begun=bool(points))
    tell(f"Recalculating points 1 to {len(points)}", 0.1)
    sensitivities = use.sensitivities([(point.spots, point.reference_spots) for point in points])
    tell("Checking the audit of the file", 0.5)
    session.know({p.number: one for p, one in zip(points, sensitivities, strict=True)})
    faults = tuple(job.verify(known.seal))
    history = settle_by_history(session, job, known.tip)
    cameras = settle_by_calibration(session, job, known.cameras)
    tell("Comparing with the stored results", 0.6)
    anew = [[one.tip_world] for one in sensitivities]
    if "thesis" in methods_used(events):
        for tips, point in zip(anew, points, strict=True):
            tips.append(use.thesis_tip(point.spots, point.reference_spots))
    differences = tuple(_differences(points, anew, plan, body))
    tell("Recalculating the results", 0.7)
    return ReopenedJob(
        path=path,
        head=head,
        plan=plan,
        rig=rig,
        body=body,
        options=options,
        view=_judged(
            session.view, (*faults, *differences, *cameras.unread, *history.unread), known.held
        ),
        T_part_from_world=session.frame.T_part_from_world,
        points=points,
        sensitivities=sensitivities,
        taken_back=taken_back,
        events=tuple(events),
        taken_utc=job.taken_utc(),
        faults=faults,
        differences=differences,
        seal=known.seal,
        history=history,
        cameras=cameras,
        recalled=known.held,
        identity=job.identity,
        left_out=known.left_out,
        held={hold_reason: session.held.held_for(hold_reason) for hold_reason in HoldReason},
    )


def _judged(view: JobView, doubts: Sequence[str], held: Sequence[str]) -> JobView:
    """Return the view, nothing in it proven where something speaks against the file or the job."""
    if not doubts and not held:
        return view
    fault = doubts[0] if doubts else ""
    why = f"The job file is suspect: {fault}" if doubts else held[0]
    results = tuple(not_proven(result, why) for result in view.characteristics)
    return replace(view, unproven=why, characteristics=results)


def _differences(
    points: Sequence[MeasuredPoint], anew: Sequence[Sequence[Float]], plan: Plan, body: ProbeBody
) -> list[str]:
    """Return where a point is not the one that is stored.

    Parameters
    ----------
    anew
        For every point where its raw spots put it, by each method that the job was measured with.
    """
    found = []
    known = {feature.name for feature in plan.features}
    for point, tips in zip(points, anew, strict=True):
        apart = float(np.nanmin(np.linalg.norm(np.array(tips) - point.tip_world, axis=1)))
        if not apart <= SAME_TIP_MM:
            found.append(
                f"Point {point.number} is {apart:.4f} mm from the position computed from "
                "its raw spots."
            )
        if point.tip_radius != body.tip_radius:
            found.append(
                f"Point {point.number} was stored with a ball of radius {point.tip_radius:.6f} mm, "
                f"but that of the probe in the file is {body.tip_radius:.6f} mm."
            )
        if point.feature not in known:
            found.append(
                f"Point {point.number} belongs to {point.feature!r}, which is not in the plan."
            )
    return found
