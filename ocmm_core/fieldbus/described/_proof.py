"""What a described camera cannot prove, what that costs, and when it must not be used."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.fieldbus.described._device_check import load_device
from ocmm_core.fieldbus.described._device_file import FORMATS, Clock, DeviceDescription, Role

UNPROVEN_CAMERAS = "CAMERAS UNPROVEN"
"""State of everything that was measured with cameras that cannot prove all that ours do."""

REST_SPEED = 2.0
"""mm/s: a ball that is said to rest moves slower than this; the doubt of a time costs so much."""
_TIGHT_NS = 5_000
"""A clock that is kept within this costs a resting ball less than 0.01 µm."""
_COARSEST = 2.0
"""Steps of so many standard deviations of the noise vanish in a mean; wider ones do not."""
_FINEST = 3.0
"""What stays at a place of the sensor must be so many times the doubt of the lens: then that adds
2 % to it at most (it is uniform)."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """Something that a camera cannot prove."""

    code: str
    """Stable."""
    words: str
    """For people: what is missing and what follows from it."""
    costs_mm: float = 0.0
    """What it can add to the place of a resting ball, mm; 0: nothing."""
    of_age: bool = False
    """Nothing in the data proves how old they are or in which order they came: a plan has to allow
    such cameras."""


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
    """Return what a camera of this description cannot prove, in sentences that name it."""
    return tuple(f"Cameras '{device.name}': {doubt.words}." for doubt in doubts_of(device))


def doubt_line(device: DeviceDescription) -> str:
    """Return the same in one sentence that has room in a bar: what is missing, by name."""
    missing = ", ".join(doubt.words.partition(":")[0] for doubt in doubts_of(device))
    return f"Cameras '{device.name}': {missing}. Job and report say what follows."


def resting_doubt_mm(device: DeviceDescription) -> float:
    """Return how far a ball at rest may be from where these cameras say, mm.

    With an exposure that was at t + d instead of t, |d| <= ``doubt_ns``, a ball of the speed v is
    off by v d. The mean over the window of a touch is off by the mean speed times d alone, and what
    moved by more than 0.01 mm in 0.25 s was refused: 0.04 mm/s. `REST_SPEED` is fifty times that.
    So much is needed where each camera is wrong by itself: two rays at the angle a that are off
    by +s and -s cross s / tan(a / 2) away, 11 s where cameras see each other at 10 degrees.
    """
    return sum(doubt.costs_mm for doubt in doubts_of(device))


def refuse_coarse(
    device: DeviceDescription, *, white_px: float, pattern_px: float, pitch_mm: float
) -> None:
    """Refuse cameras whose numbers are coarser than the noise that the uncertainty is made of.

    Steps that are wider than the noise leave a resting ball at one of them, whatever is averaged,
    and what the lens in the camera rounds stays at its place on the sensor: neither shows in the
    scatter, so that U would be too small.

    Parameters
    ----------
    device
        What the cameras are.
    white_px, pattern_px
        Noise of the rig: from frame to frame, and what stays at a place of the sensor.

    Raises
    ------
    InputError
        They are coarser.
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
    """Which document may allow cameras that cannot prove the age or the order of their data.

    The value is what the document is called, what it is about, and the field that allows them.
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
    """Return what a camera lacks to prove how old its data are and in which order they came."""
    return tuple(doubt.words for doubt in doubts_of(device) if doubt.of_age)


def refuse_unproven(
    device: DeviceDescription, *, allowed: bool, by: AllowedBy = AllowedBy.PLAN
) -> None:
    """Refuse cameras that cannot prove the age or the order of their data, unless allowed.

    Parameters
    ----------
    device
        What the cameras are.
    by
        Which document that would be.

    Raises
    ------
    InputError
        They cannot prove it, and the document does not allow that.
    """
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
    """Return what cameras cannot prove whose description is named; nothing where they are ours.

    A description that is not on this computer, or cannot be read, proves nothing.
    """
    if not name:
        return ()
    try:
        return doubt_sentences(load_device(name))
    except OcmmError:
        return (f"Cameras '{name}': their description cannot be read here; nothing is proven.",)
