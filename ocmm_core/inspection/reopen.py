"""A job opened read-only from its own file, computed anew and compared with what is stored.

Plan, cameras, probe, reference body and temperatures are in the job file, as they were. Nothing
else is needed: no document of this computer, no record, no clock. The file is copied first
(`inspection.reopen_copy`), so that it may lie where nobody can write, come from another computer
or an older version, or be measured by another program at the moment.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np

from ocmm_core.calibration.probe_design import load_design
from ocmm_core.calibration.probe_in_use import TEXT_SCHEMA, ProbeText
from ocmm_core.calibration.probe_records import probe_from_records
from ocmm_core.calibration.probe_shape import ContactForce, body_in_use, contact_force
from ocmm_core.calibration.records import SCHEMA as CAMERA_RECORD_SCHEMA
from ocmm_core.calibration.records import CameraRecord, rig_from_record
from ocmm_core.camera.rig import Rig, load_rig
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.limits import methods_used, with_stored_limits
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.reference_use import ReferenceUse
from ocmm_core.inspection.reopen_copy import copy_of_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.inspection.view import JobView
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.measuring.temperature import EVENT as TEMPERATURE
from ocmm_core.measuring.temperature import Climate, climate_of_text
from ocmm_core.storage.job_file import JobFile
from ocmm_core.storage.rows import JobEvent, JobHead
from ocmm_core.tolerances.decision import not_proven
from ocmm_core.tolerances.result import Verdict
from ocmm_core.tracking.body import ProbeBody, load_probe
from ocmm_core.tracking.reference_body import ReferenceBody, load_reference
from ocmm_core.tracking.sensitivity import TipSensitivity

T = TypeVar("T")

SAME_TIP_MM = 0.01
"""The stored mean tip of the frames and the tip of their mean spots differ by what is not
linear between them: 0.002 mm at most in the demonstration job."""


@dataclass(frozen=True, slots=True)
class ReopenedJob:
    """A job as its own file says it is; the file is closed again.

    Attributes
    ----------
    path
        The file.
    head
        What the job says about itself, with all documents.
    plan, rig, body
        What was measured, and with what: by the file alone. ``body`` has the geometry of the
        temperatures of the job.
    options
        Limits, temperatures, contact and reference body of the job.
    view
        The job, computed anew from the points; nothing in it is proven where there are doubts.
    T_part_from_world
        The part frame; None while its datums are not measured.
    points
        Not annulled, as they are stored: ball centres in the world of the job, as warm as it was.
    sensitivities
        Of each point, computed anew from its raw spots.
    taken_back
        The points that were taken back, as they are stored, and why.
    events, taken_utc
        What happened; when each point was stored, also annulled ones.
    faults
        One sentence for everything in which the file disagrees with its own audit.
    differences
        One sentence for every point that comes out otherwise than it is stored.
    """

    path: Path
    head: JobHead
    plan: Plan
    rig: Rig
    body: ProbeBody
    options: SessionOptions
    view: JobView
    T_part_from_world: RigidTransform | None
    points: tuple[MeasuredPoint, ...]
    sensitivities: tuple[TipSensitivity, ...]
    taken_back: tuple[tuple[MeasuredPoint, str], ...]
    events: tuple[JobEvent, ...]
    taken_utc: dict[int, str]
    faults: tuple[str, ...]
    differences: tuple[str, ...]

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
        """Return all that speaks against the file, in sentences."""
        return (*self.faults, *self.differences)


def reopen_job(path: Path | str) -> ReopenedJob:
    """Open a job read-only and compute everything in it anew.

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
    with copy_of_job(path) as copy:
        try:
            # The copy is our own: one of an older version is brought up to date by this.
            with JobFile.open(copy) as job:
                return _reopened(path, job)
        except OcmmError as error:
            raise _named(error, str(copy), str(path)) from error


def _reopened(path: Path, job: JobFile) -> ReopenedJob:
    head, events = job.head, job.events()
    plan = _from_text(path, "plan", head.plan_text, load_plan)
    rig = _rig(path, head)
    body, options = _measured_with(path, _probe(path, head), events, job)
    points = job.points()
    use = ReferenceUse(rig, body, options.reference, job, begun=bool(points))
    sensitivities = [use.sensitivity(point.spots, point.reference_spots) for point in points]
    session = InspectionSession(plan, rig, body, job, options)
    faults = tuple(job.verify())
    anew = [[one.tip_world] for one in sensitivities]
    if "thesis" in methods_used(events):
        for tips, point in zip(anew, points, strict=True):
            tips.append(use.thesis_tip(point.spots, point.reference_spots))
    differences = tuple(_differences(points, anew, plan, body))
    return ReopenedJob(
        path=path,
        head=head,
        plan=plan,
        rig=rig,
        body=body,
        options=options,
        view=_judged(session.view, (*faults, *differences)),
        T_part_from_world=session.T_part_from_world,
        points=tuple(points),
        sensitivities=tuple(sensitivities),
        taken_back=tuple(job.annulled()),
        events=tuple(events),
        taken_utc=job.taken_utc(),
        faults=faults,
        differences=differences,
    )


def _judged(view: JobView, doubts: Sequence[str]) -> JobView:
    """Return the view, nothing in it proven where something speaks against the file."""
    if not doubts:
        return view
    why = f"The job file is in doubt: {doubts[0]}"
    features = tuple(
        replace(item, verdict=None if item.verdict is None else Verdict.NOT_PROVEN)
        for item in view.features
    )
    results = tuple(not_proven(result, why) for result in view.characteristics)
    return replace(view, unproven=why, features=features, characteristics=results)


def _differences(
    points: Sequence[MeasuredPoint],
    anew: Sequence[Sequence[Float]],
    plan: Plan,
    body: ProbeBody,
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
                f"Point {point.number} lies {apart:.4f} mm from where its raw spots put it."
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


def _rig(path: Path, head: JobHead) -> Rig:
    """Return the cameras, of a calibration record or of the rig document itself."""
    if _schema(head.rig_text) != CAMERA_RECORD_SCHEMA:
        return _from_text(path, "rig", head.rig_text, load_rig)
    return rig_from_record(_record(path, "rig", head.rig_text, CameraRecord))


def _probe(path: Path, head: JobHead) -> ProbeBody:
    """Return the probe, of its records or of the probe document itself."""
    if _schema(head.probe_text) != TEXT_SCHEMA:
        return _from_text(path, "probe", head.probe_text, load_probe)
    text = _record(path, "probe", head.probe_text, ProbeText)
    design = _from_text(path, "probe", text.document, load_probe)
    body = probe_from_records(design, text.calibration, text.qualification)
    return replace(body, identity=head.probe_identity)


def _measured_with(
    path: Path, body: ProbeBody, events: Sequence[JobEvent], job: JobFile
) -> tuple[ProbeBody, SessionOptions]:
    """Return the probe as warm as it was, and what the session counted with."""
    recorded = [event.text for event in events if event.kind == TEMPERATURE]
    climate = climate_of_text(recorded[-1]) if recorded else Climate()
    contact = None
    if climate.probe_design:
        design = _from_text(
            path, "design of the probe", climate.probe_design, lambda file: load_design(file, body)
        )
        contact = contact_force(design, body)
        body = body_in_use(body, design, climate.probe)
    stored = job.reference()
    reference: ReferenceBody | None = None
    if stored is not None:
        reference = _from_text(path, "reference body", stored.text, load_reference)
    options = SessionOptions(climate=climate, contact=contact, reference=reference)
    return body, with_stored_limits(options, events)


def _schema(text: str) -> str:
    """Return the ``schema`` of a record; empty where the text is a document, which is no JSON."""
    try:
        return msgspec.json.decode(text.encode("utf-8"), type=_Head).schema
    except msgspec.MsgspecError:
        return ""


class _Head(msgspec.Struct, frozen=True):
    schema: str = ""


def _record(path: Path, what: str, text: str, kind: type[T]) -> T:
    try:
        return msgspec.json.decode(text.encode("utf-8"), type=kind)
    except msgspec.MsgspecError as error:
        raise InputError(
            "job.record",
            f"{path}: the record of the {what} in the job cannot be read: {error}.",
            "Open the job with the program that wrote it.",
        ) from error


def _from_text(path: Path, what: str, text: str, load: Callable[[Path], T]) -> T:
    """Return what a document in the job says; ``load`` takes it from a file."""
    with tempfile.TemporaryDirectory(prefix="ocmm-document-") as folder:
        file = Path(folder) / "document.toml"
        file.write_bytes(text.encode("utf-8"))
        try:
            return load(file)
        except OcmmError as error:
            raise _named(error, str(file), f"{path} ({what})") from error


def _named(error: OcmmError, name: str, told: str) -> OcmmError:
    """Return an error that names what the person opened instead of a copy of it."""
    return type(error)(
        error.code, error.what.replace(name, told), error.remedy.replace(name, told)
    )
