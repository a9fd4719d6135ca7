"""Build a station that is ready to start."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from ocmm_core import tracking
from ocmm_core.acceptance import thermometer_log
from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.acquisition.recording import FrameHistory, FrameRecorder
from ocmm_core.calibration.records import CalibrationInUse, ProbeInUse
from ocmm_core.cleanup import clear_leftovers
from ocmm_core.composition import _calibration_choice as calibration_choice
from ocmm_core.composition._climate import climate_in_use
from ocmm_core.composition._defaults import RECOMMENDED_RIG
from ocmm_core.composition._feeds import Remaining, ScriptedRig, StationRequest, written_folders
from ocmm_core.composition._sources import make_feed, source_of
from ocmm_core.documents import resource, text_digest
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.fieldbus.described import refuse_unproven, resting_doubt_mm
from ocmm_core.inspection import plan as plans
from ocmm_core.inspection.evaluation import JobHeader, SessionOptions, open_plan
from ocmm_core.inspection.finished import previous_part_pose, require_new_serial
from ocmm_core.inspection.session import HEADER_EVENT, check_header, header_text
from ocmm_core.measuring import PointOptions
from ocmm_core.settings import released_plans_only
from ocmm_core.station import MeasuringStation, StationOptions, free_path, give_back
from ocmm_core.storage import NAMED, JobFile, make_head


@dataclass(frozen=True, slots=True)
class BuiltStation:
    """A station and related facts for its composition root."""

    station: MeasuringStation
    """Not started; `MeasuringStation.close` releases everything."""
    job_path: Path
    description: SourceDescription
    virtual: ScriptedRig | None
    live: bool
    passed_over: tuple[OcmmError, ...] = ()
    """Errors of unreadable jobs in the batch folder."""
    recorded: str = ""
    """Source name in the recording; empty without replay."""
    hand: Any = None
    """Lets the user hold the probe; None for real probes and scripts that end."""


def build_station(request: StationRequest) -> BuiltStation:
    """Load documents, make the job file, return the station; OcmmError, all closed again."""
    clear_leftovers(written_folders(request))
    request = replace(request, released_only=request.released_only or released_plans_only())
    shipped = source_of(request.source).spec.rig
    if shipped and request.rig == RECOMMENDED_RIG:
        request = replace(request, rig=resource("rigs", shipped))
    if request.resume is None:
        if request.released_only:
            plans.require_released(request.plan, plans.plan_release(request.plan))
        plan, text = plans.read_plan(request.plan)
        plans.require_consistent(request.plan, plan)
        return _built(request, plan, text, None)
    job = JobFile.open(request.resume)
    try:
        return _built(request, plans.stored_plan(job.head), job.head.plan_text, job)
    except BaseException:
        job.close()
        raise


def _built(
    request: StationRequest, plan: plans.Plan, plan_text: str, begun: JobFile | None
) -> BuiltStation:
    probe = probe_of(request)
    reference = reference_of(request, probe.body)
    made = probe.records.calibration if probe.records is not None else None
    climate = climate_in_use(request.climate, plan, probe.body, made)
    calibration = calibration_of(request)
    device = calibration.device
    if device is not None:
        # Checked before opening cameras; the station repeats it for each job.
        refuse_unproven(device, allowed=plan.cameras == "unproven")
    feed = make_feed(
        request, plan if begun is None else open_plan(plan, begun), calibration.rig, untimed=True
    )
    try:
        _check_slots(probe.body, reference, feed.description)
        _check_timing(reference, feed.description)
    except BaseException:
        feed.ring.close()
        raise
    calibration = replace(
        calibration_choice.checked_for_replay(calibration, feed.recorded),
        untimed=feed.description.untimed,
    )
    probe = calibration_choice.checked_probe_for_replay(
        replace(probe, body=climate.body), feed.recorded
    )
    # Features of later plans that the virtual part lacks cannot be touched.
    operator = feed.operator
    there = operator.features if operator is not None else frozenset[str]()
    recorder = None
    job = None
    passed_over: list[OcmmError] = []
    try:
        near = None
        if reference is None and begun is None and request.batch:
            near = previous_part_pose(
                request.out, request.batch, text_digest(plan_text), calibration.rig.identity
            )
        job = begun or _new_job(request, plan, plan_text, calibration, probe, passed_over)
        if request.record is not None:
            recorder = FrameRecorder(request.record, feed.description, calibration.rig)
        station = MeasuringStation(
            plan,
            calibration,
            probe,
            job,
            feed.acquisition,
            feed.ring,
            StationOptions(
                session=SessionOptions(
                    point=PointOptions(
                        untimed_mm=resting_doubt_mm(device, feed.description.skew_ns)
                    ),
                    climate=climate.climate,
                    contact=climate.contact,
                    reference=reference,
                    near=near,
                ),
                tracking=tracking.TrackingOptions(method=request.method),
                live_source=feed.live,
                intent=operator.intent if operator is not None and not request.idle else None,
                follow=(
                    operator.follow(lambda: _missing(station, there), stay=request.stay)
                    if operator is not None
                    else None
                ),
                pause=timedelta(hours=request.check_after_h),
                stream=request.stream,
                room_log=(
                    thermometer_log(request.thermometers, datetime.now(UTC))
                    if request.thermometers
                    else None
                ),
                plan_file=request.plan if begun is None else None,
                released_only=request.released_only,
                simulated=feed.description.simulated,
                frame_period_ns=feed.description.frame_period_ns,
            ),
            recorder,
            FrameHistory(feed.description, calibration.rig),
        )
    except BaseException:
        feed.ring.close()
        if recorder is not None:
            recorder.close()
        if job is not None:
            give_back(job, made=begun is None)
        raise
    try:
        if begun is not None:
            station.job.change(lambda session: session.pausing.go_on(request.operator))
        if not request.room.empty:
            station.job.change(
                lambda session: session.conditions.note_room(request.room, request.operator)
            )
        if request.probing != station.job.view().probing:
            station.job.change(lambda session: session.steps.set_order(request.probing))
    except BaseException:
        station.close()
        raise
    hand = operator.hand() if operator is not None and request.stay else None
    return BuiltStation(
        station, job.path, feed.description, feed.virtual, feed.live, tuple(passed_over),
        feed.recorded, hand,
    )  # fmt: skip


def _new_job(
    request: StationRequest,
    plan: plans.Plan,
    plan_text: str,
    calibration: CalibrationInUse,
    probe: ProbeInUse,
    passed_over: list[OcmmError],
) -> JobFile:
    """Return a new job file with its header; `passed_over` gets errors of other jobs."""
    header = JobHeader(request.operator, plan.part, request.serial, request.order, request.batch)
    check_header(header)
    job_path = _job_path(request.out, plan)
    require_new_serial(request.out, header.batch, header.serial, passed_over.append)
    head = make_head(
        plan=request.plan,
        rig=request.rig,
        probe=request.probe,
        operator=header.operator,
        part=header.part,
        serial=header.serial,
    )
    # As they were read: the files may have been replaced since.
    head = replace(
        head, plan_text=plan_text, rig_text=calibration.rig_text, probe_text=probe.probe_text
    )
    job = JobFile.create(job_path, head)
    job.append_event(NAMED, job_path.stem)
    if request.order or request.batch:
        job.append_event(HEADER_EVENT, header_text(header))
    plans.note_release(job, plans.plan_release(request.plan))
    return job


def calibration_of(request: StationRequest) -> CalibrationInUse:
    """Return the calibration of a request; raise InputError as `choose_calibration`."""
    return calibration_choice.choose_calibration(
        request.source, request.rig, request.calibrations, uncalibrated=request.uncalibrated
    )


def probe_of(request: StationRequest) -> ProbeInUse:
    """Return the probe of a request; raise InputError as `choose_probe`."""
    return calibration_choice.choose_probe(
        request.source,
        request.probe,
        request.probes,
        request.tip,
        uncalibrated=request.uncalibrated,
    )


def reference_of(
    request: StationRequest, probe: tracking.ProbeBody
) -> tracking.ReferenceBody | None:
    """Return the reference body, or None; InputError if invalid or indistinguishable."""
    if request.reference is None:
        return None
    reference = tracking.load_reference(request.reference)
    tracking.check_together(probe, reference)
    return reference


def _check_slots(
    probe: tracking.ProbeBody, reference: tracking.ReferenceBody | None, source: SourceDescription
) -> None:
    """Refuse more LEDs than the cameras of a source track."""
    count = probe.n_leds + (reference.n_leds if reference is not None else 0)
    if count > source.n_slots:
        raise InputError(
            "camera.windows",
            f"Probe and reference body have {count} LEDs together, but a camera of the source "
            f"'{source.name}' sends the spots of {source.n_slots} windows.",
            f"Choose bodies with {source.n_slots} LEDs together at most, or the source "
            "'simulated', which has as many windows as LEDs.",
        )


def _check_timing(reference: tracking.ReferenceBody | None, source: SourceDescription) -> None:
    """Refuse a reference body, which may move, before cameras without a common exposure time."""
    if reference is not None and source.untimed:
        raise InputError(
            "reference.untimed",
            f"A reference body may move, and the source '{source.name}' does not prove that its "
            "cameras expose at the same time.",
            "Use cameras with a common clock (PTP), or measure without a reference body.",
        )


def _missing(station: MeasuringStation, there: frozenset[str]) -> Remaining:
    """Return the remaining touches of the features that exist on the part."""
    touches = [item for item in station.job.missing() if item[0] in there and item[1] > 0]
    if not touches:
        return (), {}
    job = station.job.view()
    taken = {name: [p.tip_world.tolist() for p in job.feature(name).points] for name, _ in touches}
    return touches, taken


def _job_path(folder: Path, plan: plans.Plan) -> Path:
    """Return an unused job file name in `folder`, which is created if missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(
            "out.folder",
            f"{folder}: the output folder cannot be created ({error.strerror}).",
            "Choose a folder that can be written: option out of the command, or Settings, Jobs.",
        ) from error
    if not os.access(folder, os.W_OK):
        raise StorageError(
            "out.folder",
            f"{folder}: the output folder is not writable.",
            "Choose a folder that can be written: option out of the command, or Settings, Jobs.",
        )
    return free_path(folder, plan)
