"""Who lied, in words for people: what was found, and what to do that does not lead round it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.bundle._culprit import LEAST_PX, Culprit, CulpritVerdict, Suspect
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Float

EXPANSION = 12e-6
"""Of steel, 1/K; only to say what a difference would be as a temperature."""

_PLAUSIBLE_K = 30.0

LEAST_CONE_MM = 0.02
"""Less than this a ball moves in its cone whenever it is turned."""


@dataclass(frozen=True, slots=True)
class Names:
    """What people call the things of a session.

    Attributes
    ----------
    cameras, bars
        Their names.
    procedure
        What is to be done again, as "the relocation".
    moment
        Words for the first observation of a block of the history, as "pose 94".
    """

    cameras: tuple[str, ...]
    bars: tuple[str, ...]
    procedure: str
    moment: Callable[[int], str]


def accuse(verdict: CulpritVerdict, names: Names) -> Finding | None:
    """Return the finding that names who lied; None where nobody did."""
    if not verdict.named:
        return None
    best = verdict.named[0]
    told = [_told(one, verdict, names) for one in verdict.named]
    code = f"{'relocation' if names.bars else 'pivot'}.{_CODES[best.cause]}"
    during = all(one.profile is not None for one in verdict.named)
    return Finding(
        code,
        _sentence(told, verdict),
        _remedy(verdict.named, names),
        refuses=not during or verdict.effect_px > LEAST_PX or _moved_mm(best) > LEAST_CONE_MM,
    )


_CODES = {
    Culprit.BAR: "bar_contradicts",
    Culprit.SIZE: "bar_contradicts",
    Culprit.LED: "probe_changed",
    Culprit.PROBE: "wrong_probe",
    Culprit.LENS: "lens_changed",
    Culprit.RIG: "wrong_rig",
    Culprit.CAMERA: "camera_moved",
    Culprit.LOOSE: "led_loose",
    Culprit.WARMING: "warming",
    Culprit.CONE: "moved",
    Culprit.PLACE: "camera_elsewhere",
}


def _moved_mm(suspect: Suspect) -> float:
    """Return how far the cone moved, mm; zero for every other cause."""
    if suspect.cause is not Culprit.CONE:
        return 0.0
    return float(np.linalg.norm(suspect.score.size))


def _sentence(told: Sequence[str], verdict: CulpritVerdict) -> str:
    if len(told) == 1:
        text = f"{told[0]}."
    elif len(told) == 2:
        text = f"Either {told[0]}, or {told[1]}: these observations cannot tell which."
    else:
        listed = ", or ".join(told)
        text = f"One of these is wrong, and the observations cannot tell which: {listed}."
    text = text[0].upper() + text[1:]
    if not verdict.explained:
        text += (
            f" That explains most, but the residuals stay {np.sqrt(verdict.misfit):.1f} times "
            f"what their sigmas say: something else may be wrong too."
        )
    return text


def _told(suspect: Suspect, verdict: CulpritVerdict, names: Names) -> str:
    state, cause, index = verdict.history.state, suspect.cause, suspect.subject
    size = suspect.score.size
    if cause is Culprit.BAR:
        off = float(size[0])
        return (
            f"bar '{names.bars[index]}' is {1e3 * abs(off):.0f} um "
            f"{'longer' if off > 0.0 else 'shorter'} than certified"
            f"{_as_temperature(off / state.lengths[index])}"
        )
    if cause in (Culprit.SIZE, Culprit.WARMING):
        part = float(size[0])
        larger = "larger" if part > 0.0 else "smaller"
        if cause is Culprit.SIZE:
            return (
                f"the whole probe is {1e6 * abs(part):.0f} um/m {larger} than its document says"
                f"{_as_temperature(part)}"
            )
        return f"the probe became {1e6 * abs(part):.0f} um/m {larger} during the session"
    if cause is Culprit.LED:
        return (
            f"LED {index + 1} of the probe is {_um(size)} from where its document has it, and "
            f"all others are in place"
        )
    if cause is Culprit.PROBE:
        places = size.reshape(-1, 3)
        rms = float(np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))))
        return (
            f"the LEDs do not stand where the document of the probe has them, "
            f"{1e3 * rms:.0f} um RMS, and no single one explains it"
        )
    if cause is Culprit.LENS:
        return (
            f"the lens of camera '{names.cameras[index]}' is not what its calibration said "
            f"(focal length {1e3 * size[0]:+.0f} um, middle of the image {size[1]:+.2f} and "
            f"{size[2]:+.2f} px)"
        )
    if cause is Culprit.RIG:
        listed = ", ".join(f"{1e3 * one:+.0f}" for one in size[::3])
        return (
            f"the lenses of all cameras are not what the calibration of this rig said (focal "
            f"lengths {listed} um): another rig, or cameras in another order"
        )
    if cause is Culprit.CONE:
        when = "during the sweep"
        if suspect.moment is not None:
            when = f"just before {names.moment(suspect.moment)}"
        return f"the cone, or the ball in it, moved by {_um(size)} {when}"
    if cause is Culprit.PLACE:
        return (
            f"camera '{names.cameras[index]}' does not stand where its calibration says, by "
            f"{1e6 * np.linalg.norm(size[:3]):.0f} urad and {_um(size[3:])}"
        )
    if cause is Culprit.LOOSE:
        since = names.moment(suspect.moment or 0)
        return f"LED {index + 1} of the probe moved by {_um(size)} before {since}"
    amount = f"by {1e6 * np.linalg.norm(size[:3]):.0f} urad"
    if len(size) > 3:
        amount += f" and {_um(size[3:])}"
    camera = names.cameras[index]
    if suspect.moment is None:
        return f"camera '{camera}' drifted evenly, {amount} from the first observation to the last"
    return f"camera '{camera}' was nudged {amount} just before {names.moment(suspect.moment)}"


def _remedy(named: Sequence[Suspect], names: Names) -> str:
    causes = {one.cause for one in named}
    again = f"begin {names.procedure} anew"
    if {Culprit.BAR, Culprit.SIZE} <= causes:
        bar = names.bars[next(one.subject for one in named if one.cause is Culprit.BAR)]
        return (
            f"Check the temperature that was stated and the length on the certificate of '{bar}', "
            f"then {again} with another certified bar: if it says the same, the probe is wrong "
            f"and must be calibrated again; if not, '{bar}' is."
        )
    said = {
        Culprit.BAR: "Check the length on the certificate, and put the bar aside until it was "
        f"calibrated; {again} with another one.",
        Culprit.SIZE: "Check the temperature that was stated and that this is the probe that was "
        f"chosen; calibrate the probe again, and {again}.",
        Culprit.LED: "Look whether this LED is bent or loose, and fasten it; calibrate the probe "
        f"again, or take another one, and {again}.",
        Culprit.PROBE: "Choose the document of the probe that was used, or calibrate that probe "
        f"again; then {again}.",
        Culprit.LENS: "Look whether this lens is loose, and fasten it; then calibrate the cameras "
        "from known points.",
        Culprit.RIG: "Choose the rig with these cameras, in the order of its document; if it is "
        "the right one, calibrate the cameras from known points.",
        Culprit.LOOSE: f"Fasten this LED, calibrate the probe again, and {again}.",
        Culprit.CONE: f"Clamp the cone, clean it, press the ball into it evenly, and {again}.",
        Culprit.PLACE: "Verify the cameras; if that fails, calibrate them again, and only then the "
        "probe.",
        Culprit.WARMING: "Let probe, artefacts and room come to one temperature, and take no probe "
        f"out of a warm hand; then {again}.",
    }
    parts = [text for cause, text in said.items() if cause in causes]
    if Culprit.CAMERA in causes:
        who = " and ".join(
            f"'{names.cameras[one.subject]}'" for one in named if one.cause is Culprit.CAMERA
        )
        drifts = all(one.moment is None for one in named if one.cause is Culprit.CAMERA)
        parts.append(
            f"Let cameras and frame come to their temperature, keep draughts and sun away, look at "
            f"the mount of {who}, and {again}."
            if drifts
            else f"Tighten the mount of {who}, touch nothing from then on, and {again}."
        )
    return " Or: ".join(parts)


def _as_temperature(part: float) -> str:
    kelvin = abs(part) / EXPANSION
    if kelvin > _PLAUSIBLE_K:
        return ""
    return f" (as steel would be that is {kelvin:.0f} K {'warmer' if part > 0.0 else 'colder'})"


def _um(vector: Float) -> str:
    return f"{1e3 * float(np.linalg.norm(vector)):.0f} um"
