"""What a described camera cannot prove, what that costs, and when it must not be used."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described._device_file import Clock, DeviceDescription, Role

REST_SPEED = 2.0
"""mm/s: a ball that is said to rest moves slower than this; the doubt of a time costs so much."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """Something that a camera cannot prove.

    Attributes
    ----------
    code
        Stable.
    words
        For people: what is missing and what follows from it.
    costs_mm
        What it can add to the place of a resting ball, mm; 0: nothing.
    """

    code: str
    words: str
    costs_mm: float = 0.0


def doubts_of(device: DeviceDescription) -> tuple[Doubt, ...]:
    """Return what a camera of this description cannot prove."""
    found = [
        Doubt(
            "device.no_check_sum",
            "no check sum: inputs of two cameras that change places are not noticed by the bus",
        )
    ]
    if not device.has(Role.COUNTER):
        found.append(
            Doubt(
                "device.no_counter",
                "no counter: old data are noticed only where they repeat to the last bit",
            )
        )
    if not device.has(Role.VALID) and not device.has(Role.INTENSITY):
        found.append(
            Doubt("device.no_validity", "no validity: a spot at exactly 0, 0 counts as not seen")
        )
    if device.clock is Clock.ARRIVAL:
        cost = REST_SPEED * device.doubt_ns * 1e-9
        found.append(
            Doubt(
                "device.arrival_time",
                f"no common clock: the time of an exposure is known within "
                f"{device.doubt_ns * 1e-6:.3g} ms, a resting ball within {cost * 1e3:.2g} µm",
                cost,
            )
        )
    elif not device.has(Role.TIME):
        found.append(
            Doubt(
                "device.no_time",
                "no time of exposure: which exposure it was is worked out from the bus clock",
            )
        )
    if device.is_corrected:
        found.append(
            Doubt(
                "device.corrected",
                "corrected in the camera: the intrinsics in it must be those of the calibration "
                f"in use; led back to pixels within {device.lens_doubt_px:.2g} px",
            )
        )
    return tuple(found)


def refuse_unproven(device: DeviceDescription, allowed_mm: float) -> None:
    """Refuse a camera whose doubts cost more than a plan allows.

    Parameters
    ----------
    device
        The camera.
    allowed_mm
        How much the doubts of the cameras may add to the place of a ball, mm.

    Raises
    ------
    InputError
        They cost more.
    """
    cost = sum(doubt.costs_mm for doubt in doubts_of(device))
    if cost > allowed_mm:
        raise InputError(
            "device.unproven",
            f"The camera '{device.name}' cannot tell the time of its exposures well enough: that "
            f"costs {cost * 1e3:.2g} µm, but only {allowed_mm * 1e3:.2g} µm are allowed.",
            "Use cameras with a distributed clock.",
        )
