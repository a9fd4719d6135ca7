"""Reports as a bus process writes them, for tests of their display."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import (
    AcquisitionWorker,
    Cycle,
    CycleVerdict,
    FrameFlag,
    FrameRing,
    SourceDescription,
)
from ocmm_core.calibration.records import open_design, open_probe_design
from ocmm_core.composition import StationRequest
from ocmm_core.documents import resource
from ocmm_core.fieldbus.report import (
    EDGES_US,
    Alarm,
    BusEvent,
    BusPhase,
    BusReport,
    CameraReport,
    Histogram,
    encode_report,
)
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.station import MeasuringStation, StationOptions
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingOptions
from ocmm_sim.scene import SimulatedSource
from ocmm_sim.sources import script_of

MORNING_NS = 1_763_712_000_000_000_000
"""2025-11-21 08:00 UTC."""

LEFT = CameraReport(
    name="left", serial=1001, alias=1, position=1, state="OP", firmware="1.4.2", boot_counter=17,
    frames=4_799_912, frames_lost=88, overruns=1, bad_cycles=3, clock_offset_ns=0,
    temperature_c=36.4, link_errors=2,
)  # fmt: skip
RIGHT = CameraReport(
    name="right", serial=1002, alias=2, position=2, state="OP", firmware="1.4.2", boot_counter=21,
    frames=4_800_000, frames_lost=0, clock_offset_ns=-38, temperature_c=37.9, emergencies=1,
)  # fmt: skip


def event(number: int, alarm: Alarm | str, camera: str, what: str, cycles: int = 1) -> BusEvent:
    """Return an event; each comes 61.5 s after the one before."""
    return BusEvent(
        number=number,
        utc_ns=MORNING_NS + number * 61_500_000_000,
        cycle=number * 61_500,
        code=str(alarm),
        camera=camera,
        what=what,
        remedy=alarm.spec.remedy if isinstance(alarm, Alarm) else "",
        cycles=cycles,
    )


IN_ORDER = BusReport(
    interface="enp3s0",
    phase=BusPhase.OPERATION,
    cameras=(LEFT, RIGHT),
    cycle_period_ns=1_000_000,
    frame_period_ns=125_000,
    elapsed=600_015,
    good=599_981,
    late=21,
    lost=10,
    bad=3,
    stray_answers=4,
    recoveries=1,
    clock_phase_ns=-1830,
    clock_drift_ppm=-12.41,
    objects_done=54,
    objects_failed=1,
    lateness=Histogram(
        edges_us=EDGES_US,
        counts=(0, 310, 102_881, 411_202, 80_113, 5_210, 240, 38, 15, 5, 1, 0),
        worst_us=6212.0,
    ),
    round_trip=Histogram(
        edges_us=EDGES_US,
        counts=(0, 0, 0, 12, 202_404, 390_033, 7_411, 130, 15, 0, 0, 0),
        worst_us=1822.0,
    ),
    events=(
        event(1, "bus.operation", "", "All cameras are in operation."),
        event(2, Alarm.LOST_ANSWERS, "", "The answer of a cycle did not come back.", 10),
        event(3, Alarm.PAYLOAD, "left", "The check sum of camera 'left' is wrong.", 3),
        event(
            4,
            Alarm.EMERGENCY,
            "right",
            "Camera 'right' reports an emergency: 0x4210, its sensor is too warm.",
        ),
        event(5, "bus.operation", "", "All cameras are in operation."),
    ),
)

MISSING = msgspec.structs.replace(
    IN_ORDER,
    phase=BusPhase.RECOVERING,
    alarm=str(Alarm.CAMERA_MISSING),
    message="Camera 'right' (serial 1002) is missing.",
    cameras=(
        LEFT,
        msgspec.structs.replace(
            RIGHT, position=0, state="-", clock_offset_ns=None, temperature_c=None
        ),
    ),
    elapsed=601_015,
    bad=1003,
    events=(
        *IN_ORDER.events,
        event(6, Alarm.CAMERA_MISSING, "right", "Camera 'right' (serial 1002) is missing.", 1000),
    ),
    notes=("This process may not use a real-time priority: expect late cycles.",),
)

FOUR = msgspec.structs.replace(
    IN_ORDER,
    redundant_interface="enp4s0",
    redundancy_broken=True,
    phase=BusPhase.DISTURBED,
    alarm=str(Alarm.WATCHDOG),
    message="Camera 'lower right' waited too long for this computer.",
    cameras=(
        LEFT,
        RIGHT,
        CameraReport(
            name="lower left", serial=10_003, alias=3, position=3, state="OP",
            frames=4_800_000, clock_offset_ns=112,
        ),
        CameraReport(
            name="lower right", serial=10_004, alias=4, position=4, state="SAFEOP",
            al_code=0x1B, al_text="sync manager watchdog", frames=4_799_000, frames_lost=1000,
        ),
    ),
)  # fmt: skip


def publish(ring: FrameRing, report: BusReport) -> None:
    """Write a report the way the bus process does."""
    ring.set_report(encode_report(report))


class Switch:
    """A source that can be made silent, as cameras without power are.

    Parameters
    ----------
    source
        Gives the frames, at its own pace.
    """

    def __init__(self, source: SimulatedSource) -> None:
        self._source = source
        self.silent = False

    @property
    def description(self) -> SourceDescription:
        """Return the description of the source; it is pushed as well."""
        return replace(self._source.description, live=True)

    def open(self) -> None:
        """Open the source."""
        self._source.open()

    def read(self) -> Cycle:
        """Return a cycle of the source; while it is silent its frames are lost."""
        cycle = self._source.read()
        if cycle.frames is None:
            return cycle
        if not self.silent:
            # Only requested touches are taken.
            cycle.frames.flags[:] &= np.uint32(~FrameFlag.BUTTON & 0xFFFFFFFF)
            return cycle
        return Cycle(CycleVerdict.LOST, "no answer", frames_lost=len(cycle.frames))

    def close(self) -> None:
        """Close the source."""
        self._source.close()


@dataclass(frozen=True, slots=True)
class BusStation:
    """A station that takes its frames for those of a bus, and what plays the bus."""

    station: MeasuringStation
    ring: FrameRing
    switch: Switch


def station_on_bus(folder: Path, *, plan: str = "quick.toml") -> BusStation:
    """Return a station on the virtual rig in real time; its reports are written by the test."""
    request = StationRequest(
        plan=resource("plans", plan), out=folder, speed=1.0, stay=True, frame_rate_hz=800
    )
    plan_read, probe = load_plan(request.plan), open_probe_design(request.probe)
    calibration = open_design(request.rig)
    virtual = script_of(request, plan_read).build()
    switch = Switch(SimulatedSource(virtual, request.speed, hover=True))
    ring = FrameRing.create(len(calibration.rig.cameras))
    head = make_head(
        plan=request.plan, rig=request.rig, probe=request.probe, operator="demo",
        part=plan_read.part, serial="1",
    )  # fmt: skip
    station = MeasuringStation(
        plan_read,
        calibration,
        probe,
        JobFile.create(folder / "job.ocmm", head),
        AcquisitionWorker(switch, ring),
        ring,
        StationOptions(SessionOptions(), TrackingOptions(), live_source=True),
    )
    return BusStation(station, ring, switch)
