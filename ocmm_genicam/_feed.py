"""Cameras of a source as a feed of the station."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.acquisition.bus_process import ChildProcess
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.calibration.records import default_folder, store_folder
from ocmm_core.camera import MAX_SLOTS, USUAL_SLOTS, Rig
from ocmm_core.composition import Feed, StationRequest
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import Plan
from ocmm_core.tracking import load_probe, load_reference
from ocmm_genicam._black import black_path
from ocmm_genicam._link import volume_window
from ocmm_genicam._process import GenicamConfig, genicam_command, genicam_description
from ocmm_genicam._set_up import Expected

PREFIX = "genicam:"
UNTIMED, GENTL, REGION = "untimed", "gentl", "region"
"""Before the serial numbers: cameras without proof of a common exposure time, cameras by GenTL
producers, and images of the part of the sensor that shows the volume."""


def expected_cameras(rig: Rig, n_slots: int = USUAL_SLOTS) -> tuple[Expected, ...]:
    """Return the cameras of a rig, all of each sensor."""
    period_ns = round(1e9 / rig.frame_rate_hz)
    return tuple(
        Expected(one.name, one.width, one.height, period_ns, n_slots=n_slots) for one in rig.cameras
    )


def slots_for(n_leds: int) -> int:
    """Return the number of spots of a camera: more than eight LEDs leave room for reflections."""
    return USUAL_SLOTS if n_leds <= USUAL_SLOTS else min(n_leds + USUAL_SLOTS, MAX_SLOTS)


def genicam_feed(request: StationRequest, _plan: Plan, rig: Rig, value: str) -> Feed:
    """Return the cameras named in a source; InputError if they are not those of the rig."""
    serials, words = _serials(value)
    untimed = UNTIMED in words
    require_cameras_of(rig, serials)
    probe = load_probe(request.probe)
    n_leds = probe.n_leds
    if request.reference is not None:
        n_leds += load_reference(request.reference).n_leds
    ring = FrameRing.create(len(rig.cameras), n_slots=slots_for(n_leds))
    timing = "exposure times not proven" if untimed else "exposure times proven by PTP"
    folder = store_folder(request.calibrations or default_folder(), rig.name)
    reach_mm = float(np.linalg.norm(probe.leds_probe - probe.tip_probe, axis=1).max())
    cameras = [
        replace(
            one, black=str(black_path(folder, serial)),
            window=volume_window(model, rig.volume_world, reach_mm) if REGION in words else None,
        )
        for one, serial, model in zip(
            expected_cameras(rig, ring.n_slots), serials, rig.cameras, strict=True
        )
    ]  # fmt: skip
    config = GenicamConfig(
        name=f"GenICam {', '.join(serials)} ({timing})", ring_path=str(ring.path),
        serials=serials, cameras=tuple(cameras),
        rig_serials=tuple(one.serial for one in rig.cameras), untimed=untimed,
        gentl=GENTL in words,
    )  # fmt: skip
    acquisition = ChildProcess(genicam_command(), config.to_json(), ring)
    return Feed(acquisition, ring, genicam_description(config), live=True)


def _serials(value: str) -> tuple[tuple[str, ...], set[str]]:
    """Return the serial numbers of a source, and the words before them."""
    parts = [part.strip() for part in value.split(",")]
    words = set()
    while parts and parts[0] in (UNTIMED, GENTL, REGION):
        words.add(parts.pop(0))
    return tuple(parts), words


def named_cameras(source: str, rig: Rig) -> tuple[tuple[str, ...], list[Expected], bool]:
    """Return the serial numbers of a source, the cameras of the rig, and whether GenTL reads them.

    InputError for another source, or for other cameras.
    """
    serials, words = _serials(source.removeprefix(PREFIX))
    if not source.startswith(PREFIX) or serials == ("virtual",):
        raise InputError(
            "genicam.source",
            f"Cameras are set up by their serial numbers, {PREFIX}SERIAL,SERIAL, and the source is "
            f"{source!r}.",
            "Choose them in the settings or by --source; ocmm camera genicam lists them.",
        )
    require_cameras_of(rig, serials)
    return serials, list(expected_cameras(rig)), GENTL in words


def require_cameras_of(rig: Rig, serials: tuple[str, ...]) -> None:
    """Raise InputError unless these are the cameras of the rig, in its order."""
    wanted = [str(one.serial) for one in rig.cameras]
    named = ["".join(filter(str.isdigit, serial)).lstrip("0") for serial in serials]
    if named != wanted:
        raise InputError(
            "genicam.serials",
            f"The source names the cameras {', '.join(serials)}, but the rig '{rig.name}' has "
            f"{', '.join(wanted)}.",
            "Give the serial numbers of the cameras in the order of the rig; field 'serial' of the "
            "rig has the digits of each.",
        )
