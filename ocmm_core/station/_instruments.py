"""Cameras, probe and reference body of a station: may points be recorded, and if not, why."""

from __future__ import annotations

from datetime import UTC, datetime

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import (
    Blocker,
    CalibrationInUse,
    CalibrationOverview,
    CalibrationStatus,
    CalibrationView,
    ProbeInUse,
    ProbeOverview,
    ProbeView,
    overview,
    probe_overview,
)
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.wire import is_virtual_interface
from ocmm_core.measuring import UNKNOWN_SKEW, RefusalCode
from ocmm_core.station._bus_watch import BusWatch
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._open_job import CurrentJob, Gear, OpenJob
from ocmm_core.tracking import CameraSkew, TrackBlock, in_rig


class Instruments:
    """Trust in the equipment.

    `current`: its watches judge the tip and the monitor's findings. `bus`: None if frames do not
    come over one. `simulated`: the frames are known to come from a virtual rig.
    """

    def __init__(
        self,
        gear: Gear,
        calibration: CalibrationWatch,
        current: CurrentJob,
        bus: BusWatch | None,
        faults: StationFaults,
        events: StationEvents,
        *,
        simulated: bool,
    ) -> None:
        self.rig, self.body, self.reference = gear.rig, gear.body, gear.reference
        self._gear, self._calibration, self._current = gear, calibration, current
        self._bus, self._simulated = bus, simulated
        self._faults, self._events = faults, events
        self.skew: CameraSkew | None = None
        """As of the last frames; None before them, and for cameras with proven exposure times."""

    @property
    def simulated(self) -> bool:
        """Return whether frames come from a virtual rig, as far as known."""
        report = self._bus.report() if self._bus is not None else None
        return self._simulated or (report is not None and is_virtual_interface(report.interface))

    @property
    def calibration_in_use(self) -> CalibrationInUse:
        """Return the calibration at the start of the job, and its store."""
        return self._gear.calibration

    @property
    def probe_in_use(self) -> ProbeInUse:
        """Return the probe at the start of the job, and its records."""
        return self._gear.probe

    def calibration(self) -> CalibrationView:
        """Return the state of the calibration, at most 0.2 s old."""
        try:
            return self._calibration.view()
        except Exception as error:
            told = self._faults.fail(error, "Monitoring the calibration")
            return CalibrationView(
                word=CalibrationStatus.UNUSABLE,
                rig=self.rig.name,
                identity=self.rig.identity,
                blocker=Blocker(told.what, told.remedy),
            )

    def calibration_overview(self) -> CalibrationOverview:
        """Return the contents of the rig's store; reads all its records."""
        return overview(self._gear.calibration.store)

    def probe(self) -> ProbeView:
        """Return the state of probe and tip, at most 0.2 s old."""
        try:
            return self._current.now.probe.view()
        except Exception as error:
            told = self._faults.fail(error, "Monitoring the probe")
            return ProbeView(
                word=CalibrationStatus.UNUSABLE,
                probe=self.body.name,
                tip=self._gear.probe.tip,
                identity=self.body.identity,
                diameter_mm=2.0 * self.body.tip_radius,
                blocker=Blocker(told.what, told.remedy),
            )

    def probe_overview(self) -> ProbeOverview:
        """Return the contents of the probe's records; reads all of them."""
        return probe_overview(self._gear.probe.store, datetime.now(UTC))

    def blocking_reason(self) -> tuple[RefusalCode, Blocker | None]:
        """Return why points are blocked by disk, cameras or tip, or None."""
        view, now = self._calibration.view(), self._current.now
        lost = now.file.given_up
        if lost is not None:
            return RefusalCode.STORAGE, Blocker(f"NOT STORED. {lost.what}", lost.remedy)
        cameras = view.blocking_reason or (None if view.uncalibrated else now.changes.doubt)
        if cameras is not None:
            return RefusalCode.CALIBRATION, cameras
        tip = now.probe.view().blocking_reason
        if tip is None and self._gear.calibration.untimed and not (self.skew and self.skew.known):
            return RefusalCode.NOT_READY, Blocker(*UNKNOWN_SKEW)
        return RefusalCode.TIP, tip

    def note_start(self, job: OpenJob) -> None:
        """Store the equipment of a job's points from now on."""
        job.probe.start()
        calibration, view = self.calibration(), job.probe.view()
        unproven = calibration.unproven
        if unproven and view.blocker is not None:
            unproven = f"{unproven} {view.blocker.what}"
        job.session.conditions.note_calibration(
            f"{calibration.word.value} {calibration.identity}", view.note, unproven
        )
        job.session.conditions.note_climate()
        job.session.conditions.note_limits()
        job.session.conditions.note_origin(simulated=self.simulated)
        job.session.conditions.note_cameras(self._gear.calibration.camera_doubts)

    def watch_cameras(self, track: TrackBlock) -> None:
        """Feed the monitor; held points are reported as a change of the job."""
        try:
            turned = self._current.now.changes.push(in_rig(track), self._calibration.view())
        except OcmmError as error:
            self._faults.tell(error)
            turned = True
        if turned:
            self._calibration.forget()
            self._events.emit(self._events.changed)

    def watch_probe(self, block: FrameBlock) -> None:
        """Check for events of the tip; held points are reported as a change of the job."""
        try:
            changed = self._current.now.probe.push(block)
        except OcmmError as error:
            self._faults.tell(error)
            changed = True
        if changed:
            self._events.emit(self._events.changed)
