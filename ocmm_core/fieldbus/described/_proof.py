"""What a described camera cannot prove, the cost, and refusal criteria."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.fieldbus.described._device_check import load_device
from ocmm_core.fieldbus.described._device_file import FORMATS, Clock, DeviceDescription, Role

UNPROVEN_CAMERAS = "CAMERAS UNPROVEN"
"""Status of results from cameras that prove less than ours."""

REST_SPEED = 2.0
"""mm/s: upper speed of a ball at rest; converts time uncertainty to length."""
_TIGHT_NS = 5_000
"""A clock within this costs a resting ball less than 0.01 µm."""
_COARSEST = 2.0
"""Steps up to this many standard deviations of noise average out."""
_FINEST = 3.0
"""Ratio of pattern noise to lens error: adds 2 % at most (uniform distribution)."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """A property that a camera cannot prove."""

    code: str
    words: str
    """Missing proof and its consequence."""
    costs_mm: float = 0.0
    """Contribution to the position of a resting ball, mm; 0: none."""
    of_age: bool = False
    """Age and order of data are unproven: the plan must allow such cameras."""


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
                of_age=True,
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
                of_age=True,
            )
        )
    elif not device.has(Role.TIME):
        found.append(
            Doubt(
                "device.no_time",
                "no time of exposure: which exposure it was is worked out from the bus clock",
                of_age=True,
            )
        )
    if device.clock is Clock.DISTRIBUTED and device.doubt_ns > _TIGHT_NS:
        cost = REST_SPEED * device.doubt_ns * 1e-9
        found.append(
            Doubt(
                "device.loose_clock",
                f"loose clock: the time of an exposure is known within "
                f"{device.doubt_ns * 1e-6:.3g} ms, a resting ball within {cost * 1e3:.2g} µm",
                cost,
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


def doubt_sentences(device: DeviceDescription) -> tuple[str, ...]:
    """Return what a camera cannot prove, in sentences with its name."""
    return tuple(f"Cameras '{device.name}': {doubt.words}." for doubt in doubts_of(device))


def doubt_line(device: DeviceDescription) -> str:
    """Return what a camera cannot prove, in one short sentence."""
    missing = ", ".join(doubt.words.partition(":")[0] for doubt in doubts_of(device))
    return f"Cameras '{device.name}': {missing}. Job and report say what follows."


def resting_doubt_mm(device: DeviceDescription | None, skew_ns: int = 0) -> float:
    """Return the position error of a resting ball, mm: of described cameras, and of a skew.

    With an exposure at t + d instead of t, |d| <= ``doubt_ns``, a ball of speed v is off by v d.
    The mean over the window of a touch is off by the mean speed times d, and motion above 0.01 mm
    in 0.25 s was refused: 0.04 mm/s. `REST_SPEED` is fifty times that. The margin covers
    independent errors of the cameras: two rays at the angle a that are off by +s and -s cross s /
    tan(a / 2) away, 11 s if cameras see each other at 10 degrees.
    """
    cost = REST_SPEED * skew_ns * 1e-9
    return cost if device is None else cost + sum(doubt.costs_mm for doubt in doubts_of(device))


def refuse_coarse(
    device: DeviceDescription, *, white_px: float, pattern_px: float, pitch_mm: float
) -> None:
    """Raise InputError for cameras coarser than the noise behind the uncertainty.

    Steps wider than the noise hold a resting ball at one step whatever is averaged, and lens
    rounding is fixed to the sensor position: neither shows in the scatter, so U would be too small.
    ``white_px``, ``pattern_px``: noise from frame to frame, and fixed to the sensor position.
    """
    kinds = {entry.type for pdo in device.inputs for entry in pdo.entries if Role.X in entry.role}
    whole = any(not FORMATS[kind].startswith("<f") for kind in kinds)
    step_px = device.step / (pitch_mm if device.is_corrected else 1.0) if whole else 0.0
    if step_px > _COARSEST * white_px:
        raise InputError(
            "device.coarse",
            f"The cameras '{device.name}' send spots in steps of {step_px:.3g} px, and their noise "
            f"is {white_px:.3g} px: a mean does not come between the steps, and no uncertainty "
            "would show it.",
            f"Let the cameras send steps of {_COARSEST * white_px:.2g} px at most, or correct "
            "'noise.white_px' of the rig document.",
        )
    if device.lens_doubt_px * _FINEST > pattern_px:
        raise InputError(
            "device.coarse",
            f"The lens in the cameras '{device.name}' is undone within "
            f"{device.lens_doubt_px:.3g} px, but the rig expects only {pattern_px:.3g} px that "
            "stay at a place of the sensor.",
            f"Let the cameras compute more exactly, or give {_FINEST * device.lens_doubt_px:.2g} "
            "or more as 'noise.pattern_px' of the rig document; it is in U.",
        )


class AllowedBy(Enum):
    """Document that may allow cameras with unproven age or order of data.

    The value holds the document's name, its subject, and the field.
    """

    PLAN = ("plan", "a part may be measured", "'cameras' of the plan")
    PROCEDURE = (
        "procedure", "an acceptance test may be made", "'cameras' of a procedure of your own"
    )  # fmt: skip
    RIG = (
        "rig document", "a calibration or a verification may be made",
        "'calibrate_unproven' of the rig document",
    )  # fmt: skip


def age_doubts(device: DeviceDescription) -> tuple[str, ...]:
    """Return which proofs of data age and order a camera lacks."""
    return tuple(doubt.words for doubt in doubts_of(device) if doubt.of_age)


def refuse_unproven(
    device: DeviceDescription, *, allowed: bool, by: AllowedBy = AllowedBy.PLAN
) -> None:
    """Raise InputError for cameras with unproven data age or order, unless allowed."""
    missing = age_doubts(device)
    if missing and not allowed:
        document, may, field = by.value
        raise InputError(
            "device.unproven",
            f"The cameras '{device.name}' cannot prove how old their data are or in which order "
            f"they came ({'; '.join(missing)}), and the {document} does not allow such cameras.",
            f"Use cameras that send a counter and the time of exposure. Whether {may} without "
            f"them is for who is responsible for the {document} to decide: field {field}.",
        )


def doubts_by_name(name: str) -> tuple[str, ...]:
    """Return what cameras of a named description cannot prove; empty for our own.

    A missing or unreadable description proves nothing.
    """
    if not name:
        return ()
    try:
        return doubt_sentences(load_device(name))
    except OcmmError:
        return (f"Cameras '{name}': their description cannot be read here; nothing is proven.",)
