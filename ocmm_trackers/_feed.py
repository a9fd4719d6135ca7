"""A tracker as a feed of the station."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.acquisition.bus_process import ChildProcess
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.camera import USUAL_SLOTS, Rig
from ocmm_core.composition import Feed, StationRequest
from ocmm_core.errors import InputError
from ocmm_core.host import require_linux
from ocmm_core.inspection.plan import Plan
from ocmm_core.tracking import load_probe
from ocmm_trackers._frames import flatness
from ocmm_trackers._process import tracker_command
from ocmm_trackers._source import PROTOCOLS, TrackerConfig, tracker_description

_FLAT_SIGMAS = 20.0
"""LEDs nearer to one plane, in standard deviations of a marker, do not prove the handedness."""

_NETWORK_S, _SERIAL_S = 5.0, 8.0
"""Wait for the first reply; after a break a device starts again."""


def tracker_config(
    protocol: str, probe: Path, rig: Rig, value: str, name: str
) -> tuple[TrackerConfig, FrameRing]:
    """Return the configuration for a tracker and its ring; InputError if they cannot measure."""
    if rig.markers is None:
        raise InputError(
            "tracker.rig",
            f"The rig '{rig.name}' is one of cameras, but the source is a tracker.",
            "Give the document of the tracker (schema ocmm.tracker/1) as the rig.",
        )
    document, leds = rig.markers.document, load_probe(probe).leds_probe
    if flatness(leds) < _FLAT_SIGMAS * document.noise.sigma_along:
        raise InputError(
            "tracker.flat",
            f"The LEDs of the probe are within {flatness(leds):.2f} mm (RMS) of a plane: a "
            "mirrored tracker would show the same distances.",
            "Use a probe whose markers are not in one plane.",
        )
    host, port = _address(protocol, value)
    slots = max(USUAL_SLOTS, len(document.markers))
    ring = FrameRing.create(len(rig.cameras), n_slots=slots)
    config = TrackerConfig(
        name=name,
        protocol=protocol,
        ring_path=str(ring.path),
        host=host,
        port=port,
        document=document,
        leds=tuple((x, y, z) for x, y, z in leds.tolist()),
        serials=tuple(one.serial for one in rig.cameras),
        period_ns=round(1e9 / rig.frame_rate_hz),
        n_slots=slots,
        connect_s=_NETWORK_S if port else _SERIAL_S,
    )
    return config, ring


def tracker_feed(request: StationRequest, _plan: Plan, rig: Rig, value: str) -> Feed:
    """Return the tracker at a host and port; InputError if it cannot measure."""
    protocol = request.source.partition(":")[0]
    name = f"{PROTOCOLS[protocol].name} {value}"
    config, ring = tracker_config(protocol, request.probe, rig, value, name)
    acquisition = ChildProcess(tracker_command(), config.to_json(), ring)
    return Feed(acquisition, ring, tracker_description(config), live=True)


def _address(protocol: str, value: str) -> tuple[str, int]:
    """Return host and port, or a serial line and 0."""
    usual = PROTOCOLS[protocol].port
    if value.startswith("/") and PROTOCOLS[protocol].serial:
        require_linux("A serial line")
        return value, 0
    host, _, port = value.rpartition(":") if ":" in value else (value, "", str(usual))
    if (
        not host
        or "/" in host
        or not port.isascii()
        or not port.isdigit()
        or not 0 < int(port) < 1 << 16
    ):
        raise InputError(
            "tracker.address",
            f"{value!r} is no host with a port.",
            f"Give {protocol}:HOST:PORT, such as {protocol}:192.168.1.20:{usual}.",
        )
    return host.strip("[]"), int(port)
