"""Step-by-step bring-up, from the link to cameras in operation.

Every step is repeatable: faults deeper than a fall to SAFEOP are answered with a complete bring-up,
because only that re-identifies each camera. Steps are short, so that the caller can do other work
in between.
"""

from __future__ import annotations

import contextlib
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass

from ocmm_core.camera import CameraModel
from ocmm_core.errors import BusError
from ocmm_core.fieldbus import wire
from ocmm_core.fieldbus.cycle._health import Schedule
from ocmm_core.fieldbus.cycle._watch import TIME_DIFFERENCE
from ocmm_core.fieldbus.described import (
    Clock,
    DeviceDescription,
    InputTranslator,
    ProcessImage,
    Timing,
)
from ocmm_core.fieldbus.device import (
    COUNTER_MODULUS,
    DEFAULT_FRAME_PERIOD_NS,
    INFORMATION,
    INPUT_DTYPE,
    INPUT_LAYOUTS,
    NEWEST_LAYOUT,
    OUTPUT_STRUCT,
    CameraConfig,
    CameraIdentity,
    Control,
    InputLayout,
    Intrinsics,
    assign,
    check_sensor,
    configuration_values,
    require_raw,
)
from ocmm_core.fieldbus.objects import SYNC_MANAGER_BYTES, SYNC_MANAGERS, MailboxAreas
from ocmm_core.fieldbus.report import BusPhase

_START_TIMEOUT_NS = 2_000_000
_CLOCK_LIMIT_NS = 1000
_CLOCK_READINGS = 20
_CLOCK_TIMEOUT_S = 3.0
_CLOCK_PAUSE_S = 0.001
_LEAD_NS = 60_000_000
"""Time from programming to the first exposure; the states change meanwhile."""
_OBJECTS_PER_STEP = 8
OWN_SIZES = (INPUT_DTYPE.itemsize, OUTPUT_STRUCT.size)
"""Process data sizes of our own cameras."""

_TIME = 0x0910
_SYNC_UNIT = 0x0980
_SYNC_ACTIVATION = 0x0981
_SYNC0_START = 0x0990
_SYNC_CYCLES = 0x09A0
_SYNC_OFF, _SYNC_BOTH = b"\x00", b"\x07"
_FIRMWARE = 0x100A
_SENSOR = (1, 2, 3)
"""Information entries: serial number, sensor width and height."""


@dataclass(frozen=True, slots=True)
class BusSettings:
    """Expected cameras and their timing."""

    interface: str
    cameras: tuple[CameraIdentity, ...]
    frame_period_ns: int = DEFAULT_FRAME_PERIOD_NS
    cycle_period_ns: int = 1_000_000
    force: bool = False
    """Use the interface although the computer uses it for its network."""
    redundant_interface: str = ""
    """Interface at the other end of the ring; empty without redundancy."""
    device: DeviceDescription | None = None
    lenses: tuple[Intrinsics, ...] = ()
    """`device`, `lenses`: camera description, and intrinsics if they correct; None, empty: ours."""

    @property
    def interfaces(self) -> tuple[str, ...]:
        return (self.interface, self.redundant_interface)[: 2 if self.redundant_interface else 1]


@dataclass(slots=True)
class Session:
    """Bus state from one bring-up to the next."""

    master: wire.Master | None = None
    """Open master, from the phase SCAN on."""
    ring_is_line: bool = False
    """A redundancy cable exists, but one ring end has no link."""
    serials: tuple[int | None, ...] = ()
    """Serial numbers in wire order, as last scanned in this or an earlier bring-up."""
    places: tuple[int, ...] = ()
    """Wire position of each rig camera, 0 first."""
    layouts: tuple[InputLayout, ...] = ()
    image: ProcessImage | None = None
    translators: tuple[InputTranslator, ...] = ()
    """`image`, `translators`: for cameras described by a file; None and empty for our own."""
    stations: tuple[int, ...] = ()
    areas: tuple[MailboxAreas, ...] = ()
    """`stations`, `areas`: their station addresses and mailboxes."""
    firmware: tuple[str, ...] = ()
    start_host_ns: int = 0
    """Monotonic host time of the first exposure, as accurate as a bus clock read."""
    schedule: Schedule | None = None
    """Exposure schedule; complete after all steps."""

    @property
    def own_time(self) -> bool:
        """Return whether the cameras share no clock, so that this computer's is used."""
        return bool(self.translators) and not self.translators[0].shares_clock

    def outputs(self, next_frame: int, token: int) -> bytes:
        """Return the outputs in the cycle `token`; acknowledges all before `next_frame`."""
        if self.image is not None:
            return self.image.pack_outputs(token)
        control = Control.STREAM if token else 0
        return OUTPUT_STRUCT.pack(control, 0, (next_frame - 1) % COUNTER_MODULUS, token)

    def close(self) -> None:
        if self.master is not None:
            self.master.close()
            self.master = None


def bring_up(
    settings: BusSettings, session: Session, host_time: wire.HostTime
) -> Iterator[BusPhase]:
    """Find, check, configure and synchronise the cameras and bring them to OP.

    Yields the phase of the next step, which blocks for about 0.2 s at most. ``session`` is filled
    in; the caller must close it in any case. BusError with the camera, state or object at fault.
    """
    yield BusPhase.LINK
    for interface in settings.interfaces:
        wire.check_interface(interface, force=settings.force)
    before, session.serials = session.serials, ()
    # A ring end without link leaves a line, which needs no redundancy.
    live = _live_interfaces(settings)
    _await_devices(settings, live, host_time)
    session.serials = before
    yield BusPhase.SCAN
    session.ring_is_line = len(live) < len(settings.interfaces)
    device = settings.device
    image = session.image = ProcessImage(device) if device is not None else None
    sizes = (image.input_bytes, image.output_bytes) if image is not None else OWN_SIZES
    token = wire.OWN_TOKEN if image is None else image.heartbeat
    second = live[1] if len(live) > 1 else ""
    master = session.master = wire.Master(live[0], second, host_time, sizes, token)
    master.find()
    yield BusPhase.SCAN
    for _ in master.steps_to(wire.PREOP):
        yield BusPhase.SCAN
    found = []
    for position in range(master.n_devices):
        yield BusPhase.IDENTIFY
        found.append(master.identify(position))
    session.serials = tuple(device.serial for device in found)
    kind = (device.name, device.is_for) if device is not None else None
    session.places = assign(found, settings.cameras, kind)
    session.layouts = tuple(
        NEWEST_LAYOUT if device is not None else INPUT_LAYOUTS[found[place].revision]
        for place in session.places
    )
    session.stations = tuple(master.station(place) for place in session.places)
    yield from _configure(settings, session, master)
    config = CameraConfig(frame_period_ns=settings.frame_period_ns)
    shared = device is None or device.clock is Clock.DISTRIBUTED
    master.map(clocks=shared)
    if shared:
        yield from _settle_clocks(settings, session, master, host_time)
    yield BusPhase.START
    # No frames are read before the first cycle.
    host_time.hold()
    if shared:
        start_ns = _program_exposures(settings, session, master, host_time)
    else:
        start_ns = session.start_host_ns = host_time.now_ns() + _LEAD_NS
    session.schedule = Schedule(start_ns, settings.frame_period_ns, config.crc())
    if device is not None and image is not None:
        timing = Timing(start_ns, settings.frame_period_ns, config.crc())
        lenses: list[CameraModel | None] = [lens.model() for lens in settings.lenses]
        lenses = lenses or [None] * len(settings.cameras)
        session.translators = tuple(
            InputTranslator(device, image, camera.serial, lens, timing)
            for camera, lens in zip(settings.cameras, lenses, strict=True)
        )
    master.request(wire.SAFEOP)
    for _ in master.steps_to(wire.SAFEOP):
        yield BusPhase.START
    for place in session.places:
        master.set_output(place, session.outputs(1, 0))
    master.first_cycle()
    master.request(wire.OP)
    silent = wire.ServiceChannel()
    for _ in master.steps_to(wire.OP):
        # No step in between: without outputs the cameras' watchdogs expire.
        master.cycle(0, _START_TIMEOUT_NS, silent, ())
    master.begin_cycles()
    master.port.tally.forget()


def _live_interfaces(settings: BusSettings) -> tuple[str, ...]:
    live = []
    for interface in settings.interfaces:
        with contextlib.closing(wire.LinkWatch(interface)) as link:
            if not link.trouble():
                live.append(interface)
    return tuple(live) or (settings.interface,)


def _await_devices(settings: BusSettings, live: tuple[str, ...], host_time: wire.HostTime) -> None:
    """Probe for devices with one frame before pysoem waits for them."""
    port = wire.Port(live, host_time)
    try:
        trouble = port.link_trouble()
        if trouble:
            raise BusError(
                "bus.link_down",
                f"Interface '{settings.interface}' {trouble}.",
                "Plug in the bus cable at both ends; check the camera supply.",
            )
        port.refuse_other_masters()
        count = port.count_devices()
        if not count:
            raise BusError(
                "bus.no_cameras",
                f"No camera answers on interface '{settings.interface}'.",
                "Check the cable and that the cameras are switched on.",
            )
        if port.ring is not None and 0 < (port.ring.reached or 0) < count:
            # The second ring part would receive the reference time with an unknown delay.
            raise BusError(
                "bus.redundancy",
                f"The ring is open behind camera {port.ring.reached}, so the camera clocks on "
                "both sides cannot be synchronised.",
                f"Replace the cable behind camera {port.ring.reached}.",
            )
    finally:
        port.close()


def _configure(settings: BusSettings, session: Session, master: wire.Master) -> Iterator[BusPhase]:
    """Check the mapping; write the configuration and read it back."""
    if settings.device is not None:
        yield from _configure_described(settings.device, settings, session, master)
        return
    config = CameraConfig(frame_period_ns=settings.frame_period_ns)
    require_raw(config)
    values = configuration_values(config)
    areas, firmware = [], []
    for place, camera, layout in zip(
        session.places, settings.cameras, session.layouts, strict=True
    ):
        yield BusPhase.CONFIGURE
        label = f"'{camera.name}'"
        for number, _ in enumerate(
            wire.check_mapping(
                camera.name,
                lambda index, sub, place=place, label=label: master.read_object(  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
                    place, label, index, sub
                ),
                layout,
            )
        ):
            if number % _OBJECTS_PER_STEP == 0:
                yield BusPhase.CONFIGURE
        for index, sub, value in values:
            if master.read_object(place, label, index, sub) == value:
                continue
            master.write_object(place, label, index, sub, value)
            if master.read_object(place, label, index, sub) != value:
                raise BusError(
                    "bus.configuration",
                    f"Camera {label} did not retain its configuration (object "
                    f"{index:#06x}:{sub:02x}).",
                    "Power-cycle the camera, then open the job again.",
                )
            yield BusPhase.CONFIGURE
        check_sensor(
            camera,
            *(
                int.from_bytes(master.read_object(place, label, INFORMATION, sub), "little")
                for sub in _SENSOR
            ),
        )
        yield BusPhase.CONFIGURE
        version = master.read_object(place, label, _FIRMWARE, 0)
        firmware.append(version.decode("ascii", errors="replace"))
        registers = master.read_register(place, label, SYNC_MANAGERS, SYNC_MANAGER_BYTES)
        areas.append(MailboxAreas.decode(registers))
    session.areas, session.firmware = tuple(areas), tuple(firmware)


def _configure_described(
    device: DeviceDescription, settings: BusSettings, session: Session, master: wire.Master
) -> Iterator[BusPhase]:
    """Check the mapping of described cameras, and write their start-up values."""
    areas = []
    for place, camera in zip(session.places, settings.cameras, strict=True):
        yield BusPhase.CONFIGURE
        label = f"'{camera.name}'"
        if session.image is not None:
            for number, _ in enumerate(
                wire.check_mapping(
                    camera.name,
                    lambda index, sub, place=place, label=label: master.read_object(  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
                        place, label, index, sub
                    ),
                    session.image,
                )
            ):
                if number % _OBJECTS_PER_STEP == 0:
                    yield BusPhase.CONFIGURE
        for each in device.start_up:
            master.write_object(place, label, each.index, each.sub, each.content)
            if master.read_object(place, label, each.index, each.sub) != each.content:
                raise BusError(
                    "bus.configuration",
                    f"Camera {label} did not retain its configuration (object "
                    f"{each.index:#06x}:{each.sub:02x}).",
                    "Correct the field 'start_up' of its description, or power-cycle the camera.",
                )
            yield BusPhase.CONFIGURE
        registers = master.read_register(place, label, SYNC_MANAGERS, SYNC_MANAGER_BYTES)
        areas.append(MailboxAreas.decode(registers))
    session.areas = tuple(areas)
    session.firmware = ("",) * len(areas)


def _settle_clocks(
    settings: BusSettings, session: Session, master: wire.Master, host_time: wire.HostTime
) -> Iterator[BusPhase]:
    """Distribute the reference time until every camera's clock has settled."""
    deadline = time.monotonic() + host_time.patience * _CLOCK_TIMEOUT_S
    calm = 0
    while calm < _CLOCK_READINGS:
        yield BusPhase.CLOCKS
        master.pump_clock()
        worst_ns, worst = 0, ""
        for place, camera in zip(session.places, settings.cameras, strict=True):
            raw = master.read_register(place, f"'{camera.name}'", TIME_DIFFERENCE, 4)
            # Sign bit.
            difference = int.from_bytes(raw, "little") & 0x7FFFFFFF
            if difference > worst_ns:
                worst_ns, worst = difference, camera.name
        calm = calm + 1 if worst_ns < _CLOCK_LIMIT_NS else 0
        if time.monotonic() > deadline:
            raise BusError(
                "bus.clock",
                f"The clock of camera '{worst}' does not follow the bus ({worst_ns} ns off).",
                "Check cables and devices between the cameras; do not use an ordinary switch.",
            )
        time.sleep(_CLOCK_PAUSE_S)


def _program_exposures(
    settings: BusSettings, session: Session, master: wire.Master, host_time: wire.HostTime
) -> int:
    period, cycle = settings.frame_period_ns, settings.cycle_period_ns
    now = int.from_bytes(master.read_register(session.places[0], "on the bus", _TIME, 8), "little")
    start = (now + _LEAD_NS) // cycle * cycle
    session.start_host_ns = host_time.now_ns() + start - now
    for place, camera in zip(session.places, settings.cameras, strict=True):
        label = f"'{camera.name}'"
        for register, content in (
            (_SYNC_ACTIVATION, _SYNC_OFF),
            (_SYNC_UNIT, b"\x00"),
            (_SYNC0_START, struct.pack("<Q", start)),
            (_SYNC_CYCLES, struct.pack("<II", period, cycle - period)),
            (_SYNC_ACTIVATION, _SYNC_BOTH),
        ):
            master.write_register(place, label, register, content)
        if master.read_register(place, label, _SYNC0_START, 8) != struct.pack("<Q", start):
            raise BusError(
                "bus.clock",
                f"Camera {label} did not accept the time of the first exposure.",
                "Power-cycle the camera, then open the job again.",
            )
    return start
