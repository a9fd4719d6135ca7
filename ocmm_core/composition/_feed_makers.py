"""Makers of frame sources, listed in `_sources`: the only user of the virtual rig."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import BusConfig, BusProcess, ServiceBus
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, SourceDescription
from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.camera import USUAL_SLOTS, Rig, load_rig
from ocmm_core.composition._defaults import DEMO_PART, REAL_WIRE, SERVICE, VIRTUAL_WIRE
from ocmm_core.composition._feeds import Feed, StationRequest
from ocmm_core.composition._model_part import kept_part
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import DeviceDescription, load_device, refuse_coarse
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics
from ocmm_core.fieldbus.wire import is_virtual_interface
from ocmm_core.inspection.plan import Plan
from ocmm_core.simulation.bus import SegmentConfig, VirtualBus
from ocmm_core.simulation.calibration_scenes import CalibratingScript, CalibratingSource
from ocmm_core.simulation.scene import PixelScript, RigScript, SensorOptions, SimulatedSource

_AHEAD_S = 0.2
"""Lead of a source that waits: queries for missing points then include the last touch."""

_SCENE_FRAMES = 320
"""Maximum lead of calibration scenes over their reader."""

_PIXEL_RATE_HZ = 1000
"""Two cores compute this rate in real time with reserve."""


def script_of(request: StationRequest, plan: Plan) -> RigScript:
    """Return the script of the requested virtual rig."""
    return RigScript(
        rig=str(request.rig.absolute()),
        probe=str(request.probe.absolute()),
        part=str(_part_file(request, plan).absolute()),
        touches=tuple((feature.name, feature.points) for feature in plan.features),
        seed=request.seed,
        options=request.world,
        frame_rate_hz=request.frame_rate_hz,
        reference=str(request.reference.absolute()) if request.reference is not None else "",
    )


def _part_file(request: StationRequest, plan: Plan) -> Path:
    """Return the virtual part: the requested document, or one made from the plan."""
    if request.part != DEMO_PART or plan.model is None:
        return request.part
    return kept_part(plan, request.plan, load_rig(request.rig))


def virtual_rig_feed(request: StationRequest, plan: Plan, _rig: Rig, _value: str) -> Feed:
    """Return the virtual rig in this process; it waits for its reader."""
    virtual = script_of(request, plan).build()
    source = SimulatedSource(
        virtual, request.speed, hover=request.stay, rest_speed=request.rest_speed
    )
    description = source.description
    per_read = max(1, round(description.cycle_period_ns / description.frame_period_ns))
    ahead = round(_AHEAD_S * 1e9 / description.frame_period_ns)
    capacity = max(ahead, 2 * per_read)
    ring = FrameRing.create(len(description.camera_serials), capacity, description.n_slots)
    return Feed(
        AcquisitionWorker(source, ring), ring, description,
        live=False, virtual=virtual, simulated=source,
    )  # fmt: skip


def recording_feed(request: StationRequest, _plan: Plan, rig: Rig, value: str) -> Feed:
    """Return a recording; raise InputError if it is of another rig."""
    source = ReplaySource(Path(value), request.speed)
    try:
        source.recording.check_rig(rig)
    except BaseException:
        source.close()
        raise
    ring = FrameRing.create(len(rig.cameras), n_slots=source.description.n_slots)
    return Feed(
        AcquisitionWorker(source, ring), ring, source.description,
        live=False, recorded=source.recording.head.source,
    )  # fmt: skip


def segment_of(request: StationRequest, plan: Plan, rig: Rig) -> SegmentConfig:
    """Return software cameras playing the request's script; interface not set."""
    return _segment(script_of(_at_device_rate(request, rig), plan).to_json(), rig, request.control)


def pixel_segment_of(request: StationRequest, plan: Plan, rig: Rig) -> SegmentConfig:
    """Return the same cameras with rendered images and spot detection."""
    script = script_of(_at_pixel_rate(request), plan)
    words = PixelScript(pixels=SensorOptions(), script=script).to_json()
    return _segment(words, rig, request.control)


def wire_feed(request: StationRequest, plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the virtual rig over a virtual wire."""
    virtual = script_of(_at_device_rate(request, rig), plan).build()
    segment = segment_of(request, plan, rig)
    feed = _on_wire(rig, request.seed, virtual.frame_period_ns, segment, request.bus_processor)
    return replace(feed, virtual=virtual)


def pixel_feed(request: StationRequest, plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the virtual rig over a virtual wire, with rendered images."""
    virtual = script_of(_at_pixel_rate(request), plan).build()
    segment = pixel_segment_of(request, plan, rig)
    feed = _on_wire(rig, request.seed, virtual.frame_period_ns, segment, request.bus_processor)
    return replace(feed, virtual=virtual)


def scenes_feed(script: CalibratingScript, speed: float) -> Feed:
    """Return the virtual rig with the scenes of a calibration, in this process."""
    source = CalibratingSource(script.build(), speed)
    cameras = len(source.description.camera_serials)
    ring = FrameRing.create(cameras, _SCENE_FRAMES, source.description.n_slots)
    return Feed(AcquisitionWorker(source, ring), ring, source.description, live=False)


def scenes_wire_feed(script: CalibratingScript, _speed: float) -> Feed:
    """Return the virtual rig with the scenes of a calibration, over a virtual wire."""
    virtual = script.build()
    if virtual.world.n_slots > USUAL_SLOTS:
        raise InputError(
            "camera.windows",
            f"The scenes show {virtual.world.n_slots} LEDs, but a camera on the wire sends the "
            f"spots of {USUAL_SLOTS} windows.",
            f"Use the source 'simulated', or a body with {USUAL_SLOTS} LEDs at most.",
        )
    segment = _segment(script.to_json(), virtual.rig)
    return _on_wire(virtual.rig, virtual.seed, virtual.frame_period_ns, segment)


def _described(rig: Rig) -> tuple[DeviceDescription | None, tuple[Intrinsics, ...]]:
    """Return the camera description of a rig, and the lenses if cameras correct them."""
    if not rig.device:
        return None, ()
    device = load_device(rig.device)
    refuse_coarse(
        device,
        white_px=rig.noise.white_px,
        pattern_px=rig.noise.pattern_px,
        pitch_mm=min(camera.pitch_mm for camera in rig.cameras),
    )
    lenses = tuple(Intrinsics.of(camera, 0) for camera in rig.cameras)
    return device, lenses if device.is_corrected else ()


def _rate_of(rig: Rig) -> float:
    device, _lenses = _described(rig)
    return rig.frame_rate_hz if device is None else 1e9 / device.period_ns


def _at_device_rate(request: StationRequest, rig: Rig) -> StationRequest:
    """Return the request with the frame rate of the camera description."""
    return replace(request, frame_rate_hz=round(_rate_of(rig))) if rig.device else request


def _segment(words: str, rig: Rig, control: str = "") -> SegmentConfig:
    device, lenses = _described(rig)
    return SegmentConfig(
        device=device,
        lenses=lenses,
        interface="",
        cameras=identities(rig),
        provider=msgspec.Raw(words.encode("utf-8")),
        control=control,
    )


def _at_pixel_rate(request: StationRequest) -> StationRequest:
    """Return the request with the frame rate of rendered cameras."""
    return request if request.frame_rate_hz else replace(request, frame_rate_hz=_PIXEL_RATE_HZ)


def _on_wire(
    rig: Rig, seed: int, frame_period_ns: int, segment: SegmentConfig, processor: int | None = None
) -> Feed:
    ring = FrameRing.create(len(rig.cameras))
    bus = _bus_config(rig, ring, "", frame_period_ns, force=False)
    bus = msgspec.structs.replace(bus, processor=processor)
    name = f"{VIRTUAL_WIRE} ({rig.name}, seed {seed})"
    description = replace(_bus_description(name, rig, bus, simulated=True), stretched=True)
    return Feed(VirtualBus(bus, segment, ring), ring, description, live=True)


def cameras_feed(request: StationRequest, _plan: Plan, rig: Rig, interface: str) -> Feed:
    """Return the cameras on an interface, or on a ring of two joined by ``+``."""
    ring = FrameRing.create(len(rig.cameras))
    period_ns = round(1e9 / _rate_of(rig))
    first, _, second = interface.partition("+")
    bus = _bus_config(rig, ring, first, period_ns, force=request.force)
    bus = msgspec.structs.replace(bus, redundant_interface=second, processor=request.bus_processor)
    simulated = is_virtual_interface(first) or is_virtual_interface(second)
    description = _bus_description(f"{REAL_WIRE} {interface}", rig, bus, simulated=simulated)
    return Feed(BusProcess(bus, ring), ring, description, live=True)


def service_feed(request: StationRequest, _plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the cameras of this computer's camera service."""
    ring = FrameRing.create(len(rig.cameras))
    bus = _bus_config(rig, ring, "", round(1e9 / _rate_of(rig)), force=False)
    bus = msgspec.structs.replace(bus, processor=request.bus_processor)
    # The interface is reported later; the station queries it then.
    description = _bus_description(SERVICE, rig, bus, simulated=False)
    return Feed(ServiceBus(bus, ring), ring, description, live=True)


def _bus_config(
    rig: Rig, ring: FrameRing, interface: str, frame_period_ns: int, *, force: bool
) -> BusConfig:
    device, lenses = _described(rig)
    return BusConfig(
        device=device,
        lenses=lenses,
        cycle_period_ns=1_000_000 if device is None else device.cycle_ns,
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
    """Return the bus identities of a rig's cameras."""
    sensors = rig.sensors or (0,) * len(rig.cameras)
    return tuple(
        CameraIdentity(camera.name, camera.serial, alias, sensor, camera.width, camera.height)
        for camera, alias, sensor in zip(rig.cameras, rig.aliases, sensors, strict=True)
    )
