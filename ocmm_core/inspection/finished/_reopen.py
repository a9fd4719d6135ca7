"""Reopen a job read-only from its own file, recalculate it and compare with the stored results.

No other document, record or clock is needed; later findings on tip and cameras come from their
histories (`_later_findings`). The file is read in memory (`storage.read_job`): it can be
write-protected, from another computer or an older version, or in use.

`KnownOfJob` has all that is outside the file, so that another computer opens it identically:
histories of calibrations and tips, trusted keys, and the last known end of the job. A worker
elsewhere gets this and the bytes of the job, and looks nothing up.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core import storage
from ocmm_core.calibration.records import CalibrationStore, default_folder, default_probe_folder
from ocmm_core.camera import Rig
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import HoldReason, JobView, SessionOptions, methods_used
from ocmm_core.inspection.finished import _later_findings as later_findings
from ocmm_core.inspection.finished._points_in_doubt import History
from ocmm_core.inspection.finished._stored_documents import StoredDocuments, about
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session import InspectionSession, ReferenceUse
from ocmm_core.measuring import Climate, MeasuredPoint
from ocmm_core.named_file import FileIdentity
from ocmm_core.seals import KeyFolder, SealWord
from ocmm_core.tolerances.decisions import not_proven
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class KnownOfJob:
    """Knowledge about a job outside its file."""

    seal: storage.JobSeal
    """Its known end, its signer by the trusted keys, and missing steps."""
    cameras: later_findings.CameraHistory = field(default_factory=later_findings.CameraHistory)
    tip: later_findings.TipHistory = field(default_factory=later_findings.TipHistory)
    """`cameras`, `tip`: Later findings."""
    held: tuple[str, ...] = ()
    """Reasons why the archive of the shop holds the job."""
    left_out: str = ""


def known_alone(job: storage.JobFile, keys: KeyFolder | None = None) -> KnownOfJob:
    """Return the knowledge by its file and the trusted keys alone."""
    return KnownOfJob(replace(job.seal(keys), missing=""), left_out=job.left_out)


def known_by_file(job: storage.JobFile) -> KnownOfJob:
    """Return the knowledge common to all computers: a valid signature counts with any key."""
    seal = replace(job.seal(), missing="")
    if seal.state.word is SealWord.UNKNOWN_KEY:
        seal = replace(seal, state=replace(seal.state, word=SealWord.SEALED))
    return KnownOfJob(replace(seal, state=replace(seal.state, station="")))


def known_here(
    job: storage.JobFile,
    path: Path,
    probes: Path | None,
    calibrations: Path | None,
    store: CalibrationStore | None = None,
    keys: KeyFolder | None = None,
) -> KnownOfJob:
    """Return this computer's knowledge of a job, and remember its end.

    ``job``: own copy of the file; ``store``: of its rig in ``calibrations``, if already read.
    """
    stored = StoredDocuments(path, job.head)
    seal = job.seal(keys)
    known = KnownOfJob(
        seal,
        later_findings.ask_cameras(
            job, stored.camera_record(), calibrations or default_folder(), store
        ),
        later_findings.ask_tip(stored.probe_records(), probes or default_probe_folder()),
        storage.held_sentences(job.head.job_uuid),
        job.left_out,
    )
    job.note_seen(path, seal)
    return known


def content_and_known(
    path: Path, probes: Path | None, calibrations: Path | None
) -> tuple[bytes, bytes]:
    """Return a job's bytes and the knowledge to open it elsewhere; OcmmError if unreadable."""
    try:
        with storage.JobFile.read(path) as job:
            known = known_here(job, path, probes, calibrations)
            return job.content(), msgspec.json.encode(known)
    except OcmmError as error:
        raise about(error, path) from error


def known_from(content: bytes) -> KnownOfJob:
    """Decode the knowledge from `content_and_known`."""
    return msgspec.json.decode(content, type=KnownOfJob)


Tell = Callable[[str, float], None]
"""Receives the next step, and the share done."""

SAME_TIP_MM = 0.01
"""Tolerated difference between the stored mean tip of the frames and the tip of their mean spots,
from nonlinearity: at most 0.002 mm in the demonstration job."""


@dataclass(frozen=True, slots=True)
class ReopenedJob:
    """A job by its own file; the file is closed again."""

    path: Path
    head: storage.JobHead
    """Metadata and all documents of the job."""
    plan: Plan
    rig: Rig
    body: ProbeBody
    """`plan`, `rig`, `body`: By the file alone; ``body`` at the job's temperatures."""
    options: SessionOptions
    """Limits, temperatures, contact and reference body of the job."""
    view: JobView
    """The recalculated job; nothing in it is proven if anything is suspect."""
    T_part_from_world: RigidTransform | None
    """The part frame; None while its datums are not measured."""
    points: tuple[MeasuredPoint, ...]
    """Valid points as stored: ball centres in the world of the job, at its temperatures."""
    sensitivities: tuple[TipSensitivity, ...]
    """Per point, recalculated from its raw spots."""
    taken_back: tuple[tuple[MeasuredPoint, str], ...]
    """Annulled points as stored, and why."""
    events: tuple[storage.JobEvent, ...]
    taken_utc: dict[int, str]
    """`events`, `taken_utc`: Events; time of storage per point, also of annulled ones."""
    faults: tuple[str, ...]
    """Disagreements of the file with its own audit, a sentence each."""
    differences: tuple[str, ...]
    """Points that differ from the stored ones, a sentence each."""
    seal: storage.JobSeal
    """End of the job's chain, and its signer."""
    history: History = field(default_factory=History)
    """Findings of the probe's history on this computer."""
    cameras: History = field(default_factory=History)
    """Findings of the calibration's history, or that it is missing on this computer."""
    held: Mapping[HoldReason, Mapping[int, str]] = field(default_factory=dict)
    """Held points by reason, by the file and by these histories."""
    recalled: tuple[str, ...] = ()
    """Why the archive of the shop holds the job, as far as known to this computer."""

    identity: FileIdentity | None = None
    """The file that was read; None if its bytes came from elsewhere."""
    left_out: str = ""
    """Content outside complete steps, as a sentence; empty if none."""

    @property
    def annulled(self) -> tuple[int, ...]:
        return tuple(point.number for point, _ in self.taken_back)

    @property
    def climate(self) -> Climate:
        return self.options.climate

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return all findings against the job, in sentences."""
        tip = (*self.history.unread, *self.history.against)
        cameras = (*self.cameras.unread, *self.cameras.against)
        return (*self.faults, *self.differences, *self.recalled, *cameras, *tip)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return remarks that are no findings against the job, in sentences."""
        kinds = (storage.ADOPTED, storage.CLOCK, storage.LEFT_OUT, storage.RESCUED)
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
) -> ReopenedJob:
    """Open a job read-only and recalculate everything in it.

    ``probes``, ``calibrations``: folders of histories, None for those of this user. ``alone``:
    without histories and this computer's memory of its end. StorageError: the file is missing, no
    job file, newer than this program, damaged or unreadable. InputError: a document in it cannot be
    used. OcmmError: the points do not belong to its documents.
    """
    path = Path(path)
    tell("Copying the job", 0.0)
    with storage.JobFile.read(path) as job, _told_of(path):
        known = known_alone(job) if alone else known_here(job, path, probes, calibrations)
        return _reopened(path, job, known, tell)


def reopen_content(path: Path, file: bytes, known: KnownOfJob) -> ReopenedJob:
    """Return the job in the bytes of a file; errors as of `reopen_job`."""
    with storage.JobFile.in_memory(path, file) as job, _told_of(path):
        return _reopened(path, job, known, lambda what, share: None)


def reopen_alone(path: Path, job: storage.JobFile) -> ReopenedJob:
    """Return an open job by its file alone, called ``path``: identical on every computer.

    A valid signature counts with any key. Readers decide which keys they trust.
    """
    with _told_of(path):
        return _reopened(path, job, known_by_file(job), lambda what, share: None)


@contextlib.contextmanager
def _told_of(path: Path) -> Iterator[None]:
    try:
        yield
    except OcmmError as error:
        raise about(error, path) from error


def _reopened(path: Path, job: storage.JobFile, known: KnownOfJob, tell: Tell) -> ReopenedJob:
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
    history = later_findings.settle_by_history(session, job, known.tip)
    cameras = later_findings.settle_by_calibration(session, job, known.cameras)
    tell("Comparing with the stored results", 0.6)
    anew = [[one.tip_world] for one in sensitivities]
    if "thesis" in methods_used(events):
        for tips, point in zip(anew, points, strict=True):
            tips.append(use.thesis_tip(point.spots, point.reference_spots))
    differences = tuple(_differences(points, anew, plan, body))
    tell("Recalculating the results", 0.7)
    return ReopenedJob(
        path=path, head=head, plan=plan, rig=rig, body=body, options=options,
        view=_judged(
            session.view, (*faults, *differences, *cameras.unread, *history.unread), known.held
        ),
        T_part_from_world=session.frame.T_part_from_world, points=points,
        sensitivities=sensitivities, taken_back=taken_back, events=tuple(events),
        taken_utc=job.taken_utc(), faults=faults, differences=differences, seal=known.seal,
        history=history, cameras=cameras, recalled=known.held, identity=job.identity,
        left_out=known.left_out,
        held={hold_reason: session.held.held_for(hold_reason) for hold_reason in HoldReason},
    )  # fmt: skip


def _judged(view: JobView, doubts: Sequence[str], held: Sequence[str]) -> JobView:
    """Return the view, with nothing proven if file or job are suspect."""
    if not doubts and not held:
        return view
    fault = doubts[0] if doubts else ""
    why = f"The job file is suspect: {fault}" if doubts else held[0]
    results = tuple(not_proven(result, why) for result in view.characteristics)
    return replace(view, unproven=why, characteristics=results)


def _differences(
    points: Sequence[MeasuredPoint], anew: Sequence[Sequence[Float]], plan: Plan, body: ProbeBody
) -> Iterator[str]:
    """Yield the differences from the stored points.

    `anew`: for every point its tips from the raw spots, by each method used in the job.
    """
    known = {feature.name for feature in plan.features}
    for point, tips in zip(points, anew, strict=True):
        apart = float(np.nanmin(np.linalg.norm(np.array(tips) - point.tip_world, axis=1)))
        if not apart <= SAME_TIP_MM:
            yield (
                f"Point {point.number} is {apart:.4f} mm from the position computed from "
                "its raw spots."
            )
        if point.tip_radius != body.tip_radius:
            yield (
                f"Point {point.number} was stored with a ball of radius {point.tip_radius:.6f} mm, "
                f"but that of the probe in the file is {body.tip_radius:.6f} mm."
            )
        if point.feature not in known:
            yield f"Point {point.number} belongs to {point.feature!r}, which is not in the plan."
