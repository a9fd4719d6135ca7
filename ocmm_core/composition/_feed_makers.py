"""Makers of our own frame sources, listed in `_sources`; `ocmm_sim` has the virtual ones."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import BusConfig, BusProcess, ServiceBus
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, SourceDescription
from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.camera import Rig
from ocmm_core.composition._defaults import REAL_WIRE, SERVICE
from ocmm_core.composition._feeds import Feed, StationRequest
from ocmm_core.fieldbus.described import DeviceDescription, load_device, refuse_coarse
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics
from ocmm_core.fieldbus.wire import is_virtual_interface, require_pysoem
from ocmm_core.inspection.plan import Plan


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


def described_cameras(rig: Rig) -> tuple[DeviceDescription | None, tuple[Intrinsics, ...]]:
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
    lenses = tuple(Intrinsics.from_camera(camera, 0) for camera in rig.cameras)
    return device, lenses if device.is_corrected else ()


def rate_of(rig: Rig) -> float:
    device, _lenses = described_cameras(rig)
    return rig.frame_rate_hz if device is None else 1e9 / device.period_ns


def cameras_feed(request: StationRequest, _plan: Plan, rig: Rig, interface: str) -> Feed:
    """Return the cameras on an interface, or on a ring of two joined by ``+``."""
    require_pysoem()
    ring = FrameRing.create(len(rig.cameras))
    period_ns = round(1e9 / rate_of(rig))
    first, _, second = interface.partition("+")
    bus = bus_config(rig, ring, first, period_ns, force=request.force)
    bus = msgspec.structs.replace(bus, redundant_interface=second, processor=request.bus_processor)
    simulated = is_virtual_interface(first) or is_virtual_interface(second)
    description = bus_description(f"{REAL_WIRE} {interface}", rig, bus, simulated=simulated)
    return Feed(BusProcess(bus, ring), ring, description, live=True)


def service_feed(request: StationRequest, _plan: Plan, rig: Rig, _value: str) -> Feed:
    """Return the cameras of this computer's camera service."""
    ring = FrameRing.create(len(rig.cameras))
    bus = bus_config(rig, ring, "", round(1e9 / rate_of(rig)), force=False)
    bus = msgspec.structs.replace(bus, processor=request.bus_processor)
    # The interface is reported later; the station queries it then.
    description = bus_description(SERVICE, rig, bus, simulated=False)
    return Feed(ServiceBus(bus, ring), ring, description, live=True)


def bus_config(
    rig: Rig, ring: FrameRing, interface: str, frame_period_ns: int, *, force: bool
) -> BusConfig:
    device, lenses = described_cameras(rig)
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


def bus_description(name: str, rig: Rig, bus: BusConfig, *, simulated: bool) -> SourceDescription:
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
