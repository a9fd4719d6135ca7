"""Configuration of the bus process, as JSON."""

from __future__ import annotations

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics


class BusConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    interface: str
    ring_path: str
    cameras: tuple[CameraIdentity, ...]
    frame_period_ns: int = 125_000
    cycle_period_ns: int = 1_000_000
    """`frame_period_ns`, `cycle_period_ns`: exposure and bus cycle periods."""
    force: bool = False
    """Use the interface although the computer uses it for its network."""
    redundant_interface: str = ""
    """Interface at the other end of the ring; empty without redundancy."""
    stretched: bool = False
    """The interface belongs to a virtual wire whose time waits for this computer."""
    processor: int | None = None
    """CPU of the bus process; None: automatic."""
    device: DeviceDescription | None = None
    lenses: tuple[Intrinsics, ...] = ()
    """`device`, `lenses`: description of cameras of other makers, and their correction lenses."""

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


def read_config(content: bytes) -> BusConfig:
    """Return the configuration; raise InputError if invalid."""
    try:
        config = msgspec.json.decode(content, type=BusConfig)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.config",
            f"The configuration of the bus process is not valid: {error}.",
            "Start the bus process from OCMM, or correct that field.",
        ) from error
    cycle, frame = config.cycle_period_ns, config.frame_period_ns
    if frame < 50_000 or cycle < 250_000 or cycle % frame or cycle // frame > 8:
        raise InputError(
            "bus.periods",
            f"A bus cycle of {cycle} ns with frames every {frame} ns cannot be kept.",
            "Use a bus cycle of at least 250 us with 1 to 8 whole frame periods.",
        )
    device = config.device
    if device is not None and (device.cycle_ns, device.period_ns) != (cycle, frame):
        raise InputError(
            "bus.periods",
            f"The camera '{device.name}' needs a bus cycle of {device.cycle_ns} ns with "
            f"{device.exposures} exposure(s), not {cycle} ns with one every {frame} ns.",
            "Start it from OCMM, or correct its description.",
        )
    if device is not None and device.is_corrected and len(config.lenses) != len(config.cameras):
        raise InputError(
            "bus.config",
            f"The cameras '{device.name}' correct by themselves, but field 'lenses' says what "
            f"{len(config.lenses)} of {len(config.cameras)} correct with.",
            "Give the intrinsics of each camera.",
        )
    if not config.cameras:
        raise InputError(
            "bus.config",
            "Field 'cameras' of the bus configuration is empty.",
            "Name the cameras of the rig.",
        )
    return config
