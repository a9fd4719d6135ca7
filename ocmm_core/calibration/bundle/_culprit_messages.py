"""Messages about faulty elements: finding and remedy.

Inconsistent reference points are also explained: one moved, two exchanged, or wrong scale.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from ocmm_core.calibration.bundle._culprit import LEAST_PX, Culprit, CulpritVerdict, Suspect
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Float, Points3, rigid_fit

LEAST_CHANCE = 1e-3
"""Least probability of the remaining misfit for an explanation to be accepted."""


@dataclass(frozen=True, slots=True)
class PointsExplained:
    """One way in which the points fit."""

    what: str
    names: tuple[str, ...]


def explain_points(
    names: Sequence[str], found: Points3, listed: Points3, sigmas: Float
) -> tuple[PointsExplained, ...]:
    """Return all explanations by which the found points match the list.

    Two names exchanged, one point moved, or a list of wrong scale. Points: mm in any two frames;
    ``sigmas`` (n,): mm per axis, of the difference.
    """
    return tuple(
        explained
        for explained, square, dof in _ways(names, found, listed, sigmas)
        if dof > 0 and scipy.special.chdtrc(dof, square) > LEAST_CHANCE
    )


def _ways(
    names: Sequence[str], found: Points3, listed: Points3, sigmas: Float
) -> Iterator[tuple[PointsExplained, float, int]]:
    n = len(names)
    for first, second in combinations(range(n), 2):
        order = np.arange(n)
        order[[first, second]] = second, first
        pair = names[first], names[second]
        yield (
            PointsExplained(f"'{pair[0]}' and '{pair[1]}' were swapped", pair),
            _misfit(found, listed[order], sigmas),
            3 * n - 6,
        )
    for one in range(n):
        kept = np.arange(n) != one
        # Two remaining points determine only their distance.
        yield (
            PointsExplained(f"'{names[one]}' has moved", (names[one],)),
            _misfit(found[kept], listed[kept], sigmas[kept]),
            max(3 * (n - 1) - 6, 1) if n > 2 else 0,
        )
    ratio, _ = scale_between(found, listed, sigmas)
    what = "farther from" if ratio > 1.0 else "nearer to"
    amount = f"{1e6 * abs(ratio - 1.0):.0f} um/m"
    yield (
        PointsExplained(f"all of them are {amount} {what} each other than listed", tuple(names)),
        _misfit(found, ratio * listed, sigmas),
        3 * n - 7,
    )


def scale_between(found: Points3, listed: Points3, sigmas: Float) -> tuple[float, float]:
    """Return the scale of the found points relative to the list, and its sigma."""
    rotation, shift = rigid_fit(listed, found)
    carried = listed @ rotation.T + shift
    weights = sigmas**-2.0
    arms = carried - np.average(carried, axis=0, weights=weights)
    inertia = float(np.sum(weights[:, None] * arms**2))
    off = float(np.sum(weights[:, None] * arms * (found - carried)))
    return 1.0 + off / inertia, inertia**-0.5


def _misfit(found: Points3, listed: Points3, sigmas: Float) -> float:
    rotation, shift = rigid_fit(listed, found)
    off = found - listed @ rotation.T - shift
    return float(np.sum((off / sigmas[:, None]) ** 2))


EXPANSION = 12e-6
"""Of steel, 1/K; only to express a difference as a temperature."""

_PLAUSIBLE_K = 30.0

LEAST_CONE_MM = 0.02
"""Normal motion of a ball in its cone during rotation."""


@dataclass(frozen=True, slots=True)
class Names:
    """Display names of the elements of a session."""

    cameras: tuple[str, ...]
    bars: tuple[str, ...]
    procedure: str
    """Procedure to repeat, as "the relocation"."""
    moment: Callable[[int], str]
    """Text for the first observation of a block of the history, as "pose 94"."""
    board: str = ""


def accuse(verdict: CulpritVerdict, names: Names) -> Finding | None:
    """Return the finding on the faulty element, or None."""
    if not verdict.named:
        return None
    best = verdict.named[0]
    told = [_message(one, verdict, names) for one in verdict.named]
    code = f"{'relocation' if names.bars else 'pivot'}.{_CODES[best.cause]}"
    every = (verdict.named, *verdict.also)
    during = all(one.profile is not None for part in every for one in part)
    return Finding(
        code,
        _sentence(told, verdict, names),
        _remedy([one for part in every for one in part], names),
        refuses=not during or verdict.effect_px > LEAST_PX or _moved_mm(best) > LEAST_CONE_MM,
    )


_CODES = {
    Culprit.BAR: "bar_contradicts",
    Culprit.SIZE: "bar_contradicts",
    Culprit.TEMPERATURE: "temperature",
    Culprit.LED: "probe_changed",
    Culprit.PROBE: "wrong_probe",
    Culprit.LENS: "lens_changed",
    Culprit.RIG: "wrong_rig",
    Culprit.CAMERA: "camera_moved",
    Culprit.LOOSE: "led_loose",
    Culprit.WARMING: "warming",
    Culprit.CONE: "moved",
    Culprit.PLACE: "camera_elsewhere",
    Culprit.BOARD_SIZE: "board_size",
}


def _moved_mm(suspect: Suspect) -> float:
    """Return the displacement of the cone, mm; zero for every other cause."""
    return 0.0 if suspect.cause is not Culprit.CONE else float(np.linalg.norm(suspect.score.size))


def _sentence(told: Sequence[str], verdict: CulpritVerdict, names: Names) -> str:
    if len(told) == 1:
        text = f"{told[0]}."
    elif len(told) == 2:
        text = f"Either {told[0]}, or {told[1]}: the observations cannot tell which."
    else:
        listed = ", or ".join(told)
        text = f"One of these is wrong, and the observations cannot tell which: {listed}."
    text = text[0].upper() + text[1:]
    if (
        verdict.also
        and verdict.named[0].cause is Culprit.PROBE
        and all(part[0].cause is Culprit.LED for part in verdict.also)
    ):
        leds = " and ".join(f"LED {part[0].subject + 1}" for part in verdict.also)
        return f"{text} It fits as well if {leds} alone are elsewhere."
    for part in verdict.also:
        others = ", or ".join(_message(one, verdict, names) for one in part)
        text += f" In addition, {others}."
    if not verdict.explained:
        text += (
            f" That explains most, but the residuals are still {np.sqrt(verdict.misfit):.2f} "
            "times their sigmas: something else may be wrong too."
        )
    return text


def _message(suspect: Suspect, verdict: CulpritVerdict, names: Names) -> str:
    state, cause, index = verdict.history.state, suspect.cause, suspect.subject
    size = suspect.score.size
    if cause is Culprit.BAR:
        off = float(size[0])
        return (
            f"bar '{names.bars[index]}' is {1e3 * abs(off):.0f} um "
            f"{'longer' if off > 0.0 else 'shorter'} than certified"
            f"{_as_temperature(off / state.lengths[index])}"
        )
    if cause is Culprit.TEMPERATURE:
        kelvin = float(size[0])
        return (
            f"bar and probe are {abs(kelvin):.1f} K {'warmer' if kelvin > 0.0 else 'colder'} than "
            "the stated temperature"
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
    if cause is Culprit.BOARD_SIZE:
        part = float(size[0])
        return (
            f"the board '{names.board}' is {1e6 * abs(part):.0f} um/m "
            f"{'larger' if part > 0.0 else 'smaller'} than its document says{_as_temperature(part)}"
        )
    if cause is Culprit.LED:
        return (
            f"LED {index + 1} of the probe is {_um(size):.0f} um from its document position, all "
            "others are in place"
        )
    if cause is Culprit.PROBE:
        places = size.reshape(-1, 3)
        rms = float(np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))))
        return (
            f"the LEDs deviate from their document positions, {1e3 * rms:.0f} um RMS, and no "
            "single one explains it"
        )
    if cause is Culprit.LENS:
        return (
            f"the lens of camera '{names.cameras[index]}' does not match its calibration (focal "
            f"length {1e3 * size[0]:+.0f} um, middle of the image {size[1]:+.2f} and "
            f"{size[2]:+.2f} px)"
        )
    if cause is Culprit.RIG:
        listed = ", ".join(f"{1e3 * one:+.0f}" for one in size[::3])
        return (
            "the lenses of all cameras do not match the calibration of this rig (focal lengths "
            f"{listed} um): another rig, or cameras in another order"
        )
    if cause is Culprit.CONE:
        when = "during the sweep"
        if suspect.moment is not None:
            when = f"just before {names.moment(suspect.moment)}"
        return f"the cone, or the ball in it, moved by {_um(size):.0f} um {when}"
    if cause is Culprit.PLACE:
        return (
            f"camera '{names.cameras[index]}' is off its calibrated pose by "
            f"{1e6 * np.linalg.norm(size[:3]):.0f} urad and {_um(size[3:]):.0f} um"
        )
    if cause is Culprit.LOOSE:
        since = names.moment(suspect.moment or 0)
        return f"LED {index + 1} of the probe moved by {_um(size):.0f} um before {since}"
    turned = 1e6 * float(np.linalg.norm(size[:3]))
    amount = (
        f"by {turned:.0f} urad and {_um(size[3:]):.0f} um"
        if len(size) > 3
        else f"by {turned:.0f} urad"
    )
    camera = names.cameras[index]
    if suspect.moment is None:
        return f"camera '{camera}' drifted evenly, {amount} from the first observation to the last"
    return f"camera '{camera}' was nudged {amount} just before {names.moment(suspect.moment)}"


def _remedy(named: Sequence[Suspect], names: Names) -> str:
    causes = {one.cause for one in named}
    again = f"repeat {names.procedure}"
    if {Culprit.BAR, Culprit.SIZE} <= causes:
        bar = names.bars[next(one.subject for one in named if one.cause is Culprit.BAR)]
        return (
            f"Check the stated temperature and the certified length of '{bar}', then {again} "
            "with another certified bar. Same result: the probe is wrong and must be calibrated "
            f"again; otherwise '{bar}' is wrong."
        )
    said = {
        Culprit.BAR: "Check the certified length, and set the bar aside until it is calibrated; "
        f"{again} with another one.",
        Culprit.TEMPERATURE: "Let bar, probe and room reach one temperature, check the "
        f"thermometer and its stated uncertainty, and {again}.",
        Culprit.SIZE: "Check the stated temperature and that the right probe is selected; "
        f"calibrate the probe again, and {again}.",
        Culprit.LED: "Check this LED for bending or looseness, and fasten it; calibrate the "
        f"probe again or use another one, and {again}.",
        Culprit.PROBE: "Select the document of the probe used, or calibrate that probe again; "
        f"then {again}.",
        Culprit.LENS: "Check this lens for looseness, and fasten it; then calibrate the cameras "
        "from known points.",
        Culprit.RIG: "Select the rig with these cameras, in document order; if it is already "
        "the right one, calibrate the cameras from known points.",
        Culprit.LOOSE: f"Fasten this LED, calibrate the probe again, and {again}.",
        Culprit.CONE: f"Clamp the cone, clean it, press the ball into it evenly, and {again}.",
        Culprit.PLACE: "Verify the cameras; if that fails, calibrate them again, and only then the "
        "probe.",
        Culprit.BOARD_SIZE: "Measure the pitch of the board, and correct its document or have it "
        f"calibrated; then {again}.",
        Culprit.WARMING: "Let probe, artefacts and room reach one temperature, and do not use a "
        f"hand-warm probe; then {again}.",
    }
    parts = [text for cause, text in said.items() if cause in causes]
    if Culprit.CAMERA in causes:
        who = " and ".join(
            f"'{names.cameras[one.subject]}'" for one in named if one.cause is Culprit.CAMERA
        )
        drifts = all(one.moment is None for one in named if one.cause is Culprit.CAMERA)
        parts.append(
            "Let cameras and frame reach their temperature, keep draughts and sun away, check "
            f"the mount of {who}, and {again}."
            if drifts
            else f"Tighten the mount of {who}, touch nothing afterwards, and {again}."
        )
    return " Or: ".join(parts)


def _as_temperature(part: float) -> str:
    kelvin = abs(part) / EXPANSION
    if kelvin > _PLAUSIBLE_K:
        return ""
    return f" (as steel would be that is {kelvin:.0f} K {'warmer' if part > 0.0 else 'colder'})"


def _um(vector: Float) -> float:
    return 1e3 * float(np.linalg.norm(vector))
