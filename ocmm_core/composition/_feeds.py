"""Where frames come from: a request in names and numbers, and the source made ready.

This is the one place where the product meets the virtual rig.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import Acquisition, BusConfig, BusProcess, ServiceBus
from ocmm_core.acquisition.frames import (
    AcquisitionStatus,
    AcquisitionWorker,
    FrameRing,
    SourceDescription,
    read_status,
)
from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.camera import Rig
from ocmm_core.composition._climate import ClimateRequest
from ocmm_core.composition._defaults import DEFAULT_SEED, DEMO_PART, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.composition._source_names import PIXEL_BUS, VIRTUAL_BUSES, VIRTUAL_WIRE
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.wire import is_virtual_interface
from ocmm_core.inspection.evaluation import Probing
from ocmm_core.inspection.plan import Plan
from ocmm_core.simulation.bus import SegmentConfig, VirtualBus
from ocmm_core.simulation.scene import (
    PixelScript,
    RigScript,
    SensorOptions,
    SimulatedSource,
    VirtualRig,
    WorldOptions,
)
from ocmm_core.station.stream import StreamOptions
from ocmm_core.tracking import Method

_AHEAD_S = 0.2
"""A source that waits for its reader runs at most this far ahead of it, so that an operator who
asks what is missing hears of his last touch."""

_PIXEL_RATE_HZ = 1000
"""Two cores compute so many pictures in real time with something to spare."""


@dataclass(frozen=True, slots=True)
class StationRequest:
    """What to measure, with what, from where and to where.

    Attributes
    ----------
    plan, rig, probe, part
        Documents; the part is only for virtual rigs.
    source
        ``"simulated"``, ``"ethercat:virtual"``, ``"ethercat:pixels"``, ``"ethercat:IFACE"``,
        ``"ethercat:service"`` or ``"replay:FILE"``; two interfaces joined by ``+`` are the ends
        of a ring.
    out
        Folder of the job file; made if it does not exist.
    seed, speed, world, frame_rate_hz
        Of the virtual rig; a speed of zero is as fast as possible, a rate of zero the rig's own.
    stay
        At the end of the script the operator stays and goes on touching what is missing.
    operator, serial, order, batch
        Names for the job; order and batch may be empty.
    resume
        Job file that is gone on with, by its own plan; None for a new job.
    probing
        In the order of the plan, or in any.
    record
        File that takes all raw frames, or None.
    force
        Use a network interface although the computer needs it itself.
    method
        How poses are computed.
    control
        Socket over which faults can be made to the cameras of a virtual wire; empty: none.
    calibrations
        Folder of calibrations; None is that of this user for real cameras, and the rig document
        itself for virtual ones and replays.
    uncalibrated
        Take points whatever is the matter with calibration and tip; they prove nothing.
    probes, tip
        Folder of records of probes, as ``calibrations``; name of the tip that is on the probe, or
        None for the one that the records say.
    check_after_h
        After so many hours without a point or a check the tip must be checked.
    climate
        Temperatures of probe and part, and what is to be compensated for them.
    reference
        Document of the reference body to which everything is given; None without one.
    stream
        How points and poses are given to other programs; None where they are not.
    """

    plan: Path
    out: Path
    rig: Path = RECOMMENDED_RIG
    probe: Path = STANDARD_PROBE
    part: Path = DEMO_PART
    source: str = "simulated"
    seed: int = DEFAULT_SEED
    speed: float = 0.0
    world: WorldOptions = field(default_factory=WorldOptions)
    frame_rate_hz: int = 0
    stay: bool = False
    operator: str = "demo"
    serial: str = "1"
    order: str = ""
    batch: str = ""
    resume: Path | None = None
    probing: Probing = "plan"
    record: Path | None = None
    force: bool = False
    method: Method = "gauss-newton"
    control: str = ""
    calibrations: Path | None = None
    uncalibrated: bool = False
    probes: Path | None = None
    tip: str | None = None
    check_after_h: float = 8.0
    climate: ClimateRequest = field(default_factory=ClimateRequest)
    reference: Path | None = None
    stream: StreamOptions | None = None


_STOP_S = 3.0
"""How long an acquisition may take to end."""


@dataclass(frozen=True, slots=True)
class Feed:
    """A source of frames made ready.

    Attributes
    ----------
    acquisition, ring
        Not started; whoever takes the feed calls `end`, which stops the one and closes the other.
    description
        What the source says about itself.
    live
        Frames come by themselves.
    virtual
        The virtual rig whose script is played, None for anything else.
    simulated
        The source itself, where it is the virtual rig of this process.
    recorded
        Name of the source that was recorded; empty where nothing is replayed.
    """

    acquisition: Acquisition
    ring: FrameRing
    description: SourceDescription
    live: bool
    virtual: VirtualRig | None = None
    simulated: SimulatedSource | None = None
    recorded: str = ""

    def end(self) -> AcquisitionStatus:
        """Stop the acquisition, close the ring, and return what became of it."""
        self.acquisition.request_stop()
        self.acquisition.join(_STOP_S)
        status = read_status(self.ring)
        self.ring.close()
        return status

    @property
    def script_frames(self) -> int | None:
        """Return after how many frames the script is over; None where there is none."""
        return self.virtual.n_frames if self.virtual is not None else None


def make_feed(request: StationRequest, plan: Plan, rig: Rig) -> Feed:
    """Return the source that the request names, ready to start."""
    kind, _, name = request.source.partition(":")
    if request.source == "simulated":
        return _simulated(request, plan)
    if request.source in VIRTUAL_BUSES:
        return _virtual_bus(request, plan, rig)
    if request.source == "ethercat:service":
        return _service(request, rig)
    if kind == "ethercat" and name:
        return _bus(request, rig, name)
    if kind == "replay" and name:
        return _replay(request, rig, Path(name))
    raise InputError(
        "source.unknown",
        f"--source is {request.source!r}, which is no source of frames.",
        "Give simulated, ethercat:virtual, ethercat:pixels, ethercat:IFACE, ethercat:service or "
        "replay:FILE.",
    )


def script_of(request: StationRequest, plan: Plan) -> RigScript:
    """Return the virtual rig of the request in words."""
    return RigScript(
        rig=str(request.rig.resolve()),
        probe=str(request.probe.resolve()),
        part=str(request.part.resolve()),
        touches=tuple((feature.name, feature.points) for feature in plan.features),
        seed=request.seed,
        options=request.world,
        frame_rate_hz=request.frame_rate_hz,
        reference=str(request.reference.resolve()) if request.reference is not None else "",
    )


def _simulated(request: StationRequest, plan: Plan) -> Feed:
    virtual = script_of(request, plan).build()
    source = SimulatedSource(virtual, request.speed, hover=request.stay)
    description = source.description
    per_read = max(1, round(description.cycle_period_ns / description.frame_period_ns))
    ahead = round(_AHEAD_S * 1e9 / description.frame_period_ns)
    ring = FrameRing.create(len(description.camera_serials), max(ahead, 2 * per_read))
    return Feed(
        AcquisitionWorker(source, ring), ring, description,
        live=False, virtual=virtual, simulated=source,
    )  # fmt: skip


def _replay(request: StationRequest, rig: Rig, path: Path) -> Feed:
    source = ReplaySource(path, request.speed)
    try:
        source.check_rig(rig)
    except BaseException:
        source.close()
        raise
    ring = FrameRing.create(len(rig.cameras))
    return Feed(
        AcquisitionWorker(source, ring), ring, source.description,
        live=False, recorded=source.recording.head.source,
    )  # fmt: skip


def segment_of(request: StationRequest, plan: Plan, rig: Rig) -> SegmentConfig:
    """Return the software cameras that play the request's script; the interface is left open."""
    script = script_of(_at_own_rate(request), plan)
    words = (
        PixelScript(pixels=SensorOptions(), script=script).to_json()
        if request.source == PIXEL_BUS
        else script.to_json()
    )
    return SegmentConfig(
        interface="",
        cameras=identities(rig),
        provider=msgspec.Raw(words.encode("utf-8")),
        control=request.control,
    )


def _at_own_rate(request: StationRequest) -> StationRequest:
    """Return the request with the rate of cameras that are computed pixel by pixel."""
    if request.source == PIXEL_BUS and not request.frame_rate_hz:
        return replace(request, frame_rate_hz=_PIXEL_RATE_HZ)
    return request


def _virtual_bus(request: StationRequest, plan: Plan, rig: Rig) -> Feed:
    virtual = script_of(_at_own_rate(request), plan).build()
    ring = FrameRing.create(len(rig.cameras))
    bus = _bus_config(rig, ring, "", virtual.frame_period_ns, force=False)
    acquisition = VirtualBus(bus, segment_of(request, plan, rig), ring)
    name = f"{VIRTUAL_WIRE} ({rig.name}, seed {request.seed})"
    description = _bus_description(name, rig, bus, simulated=True)
    return Feed(acquisition, ring, description, live=True, virtual=virtual)


def _bus(request: StationRequest, rig: Rig, interface: str) -> Feed:
    ring = FrameRing.create(len(rig.cameras))
    period_ns = round(1e9 / rig.frame_rate_hz)
    first, _, second = interface.partition("+")
    bus = _bus_config(rig, ring, first, period_ns, force=request.force)
    bus = msgspec.structs.replace(bus, redundant_interface=second)
    simulated = is_virtual_interface(first) or is_virtual_interface(second)
    description = _bus_description(f"EtherCAT on {interface}", rig, bus, simulated=simulated)
    return Feed(BusProcess(bus, ring), ring, description, live=True)


def _service(request: StationRequest, rig: Rig) -> Feed:
    ring = FrameRing.create(len(rig.cameras))
    bus = _bus_config(rig, ring, "", round(1e9 / rig.frame_rate_hz), force=False)
    # Its interface is known once it has reported; the station asks then.
    name = "EtherCAT, service of this computer"
    description = _bus_description(name, rig, bus, simulated=False)
    return Feed(ServiceBus(bus, ring), ring, description, live=True)


def _bus_config(
    rig: Rig, ring: FrameRing, interface: str, frame_period_ns: int, *, force: bool
) -> BusConfig:
    return BusConfig(
        interface=interface,
        ring_path=str(ring.path),
        cameras=identities(rig),
        frame_period_ns=frame_period_ns,
        force=force,
    )


def _bus_description(name: str, rig: Rig, bus: BusConfig, *, simulated: bool) -> SourceDescription:
    return SourceDescription(
        name=name,
        camera_serials=tuple(camera.serial for camera in rig.cameras),
        frame_period_ns=bus.frame_period_ns,
        cycle_period_ns=bus.cycle_period_ns,
        live=True,
        simulated=simulated,
    )


def identities(rig: Rig) -> tuple[CameraIdentity, ...]:
    """Return how the cameras of a rig are known on the bus."""
    return tuple(
        CameraIdentity(camera.name, camera.serial, alias)
        for camera, alias in zip(rig.cameras, rig.aliases, strict=True)
    )
