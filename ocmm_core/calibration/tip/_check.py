"""What a quick check says: the mounted tip is the qualified one, it is not, or nobody knows.

A check must find a wrong diameter of `DIAMETER_DEFECT_MM` and hardly ever blame a good tip. Half
of the defect is the limit; both errors are then rare enough where the measurement is known to
a seventh of the defect. Where it is not, the check is inconclusive and asks for more points: too
large an uncertainty never passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.guided import (
    Articulation,
    BallPlace,
    RestingTouch,
    articulate,
    handle_axis,
    place_of_ball,
)
from ocmm_core.calibration.records import Check, Finding, Sphere, TipRecord
from ocmm_core.calibration.tip._errors import sigma_of_difference
from ocmm_core.calibration.tip._fit import BallFit, fit_ball_on
from ocmm_core.calibration.tip._qualification import articulation_check, form_checks
from ocmm_core.calibration.tip._views import CheckVerdict
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

DIAMETER_DEFECT_MM = 0.050
LENGTH_DEFECT_MM = 0.200
"""What must be found. A wrong length of 1 mm is five times beyond it."""

SIGMAS = 3.5
"""Between nothing and the limit, and between the limit and the defect: one in 2,000 each."""

SIDEWAYS_SIGMAS = 4.3
"""The same for a distance in a plane, which is never below zero."""

LENGTH = "tip_check.length"
"""Code of findings that say that the ball is elsewhere in the probe."""

DIAMETER_SIGMA_MM = 0.5 * DIAMETER_DEFECT_MM / SIGMAS
"""Standard uncertainty of the difference from the qualified diameter that is conclusive."""

CHANCE = 1e-4
"""Probability that form or articulation of a good tip exceed what uncertainties allow."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One quantity of a check."""

    check: Check
    sigma_wanted_mm: float
    """Standard uncertainty from which on it is conclusive; infinite where it always is."""
    finding: Finding
    """What to say where it fails."""

    @property
    def verdict(self) -> CheckVerdict:
        """Return what it says."""
        size, sigma = abs(self.check.error_mm), 0.5 * self.check.expanded_mm
        if sigma <= self.sigma_wanted_mm:
            return CheckVerdict.PASSED if size <= self.check.limit_mm else CheckVerdict.FAILED
        # An error that no such uncertainty explains is one, however uncertain its size is.
        beyond = size * self.sigma_wanted_mm > self.check.limit_mm * sigma
        return CheckVerdict.FAILED if beyond else CheckVerdict.INCONCLUSIVE


@dataclass(frozen=True, slots=True)
class TipCheckDecision:
    """What all quantities together say."""

    verdict: CheckVerdict
    """FAILED where one failed; else INCONCLUSIVE where one is; else PASSED."""
    judged: tuple[Judged, ...]
    """All that could be judged."""
    advice: str
    """Why it is not PASSED and what to do; empty where it is."""
    ball: BallFit | None
    """None before there are enough points."""
    articulation: Articulation | None
    place: BallPlace | None
    """`articulation`, `place`: None before there are enough attitudes."""

    @property
    def checks(self) -> tuple[Check, ...]:
        """Return what goes into the record."""
        return tuple(one.check for one in self.judged)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return what failed: only the cause where a tip that is elsewhere explains the rest."""
        return _causes(self.judged)


def decide_check(
    on_sphere: Sequence[RestingTouch],
    in_cone: Sequence[RestingTouch],
    sphere: Sphere,
    qualification: TipRecord,
    rig: Rig,
    body: ProbeBody,
    temperature_c: float | None,
) -> TipCheckDecision:
    """Return what the points of a check say, also of one that is not complete.

    Parameters
    ----------
    on_sphere, in_cone
        What was taken.
    rig, body
        What they were computed with.
    """
    judged: list[Judged] = []
    lacking = ""
    ball = _ball(on_sphere, sphere, rig, body, temperature_c)
    if ball is None:
        lacking = "The points on the sphere do not determine the ball yet: touch more places."
    else:
        sigma = sigma_of_difference(ball.errors, sphere, temperature_c, qualification, rig, body)
        judged += [_diameter(ball, sigma, qualification), *_form(ball)]
    place = place_of_ball(in_cone, rig, body)
    articulation = articulate(in_cone, rig, body, CHANCE) if len(in_cone) > 1 else None
    if place is None or articulation is None:
        lacking = lacking or "The attitudes in the cone do not determine the tip yet: add more."
    else:
        judged += [*_place(place, body), _articulation(articulation)]
    verdicts = [one.verdict for one in judged]
    causes = _causes(judged)
    if causes:
        verdict, advice = CheckVerdict.FAILED, f"{causes[0].what} {causes[0].remedy}"
    elif lacking:
        verdict, advice = CheckVerdict.INCONCLUSIVE, lacking
    elif CheckVerdict.INCONCLUSIVE in verdicts:
        unknown = judged[verdicts.index(CheckVerdict.INCONCLUSIVE)]
        verdict, advice = CheckVerdict.INCONCLUSIVE, _more(unknown, qualification)
    else:
        verdict, advice = CheckVerdict.PASSED, ""
    return TipCheckDecision(verdict, tuple(judged), advice, ball, articulation, place)


def _causes(judged: Sequence[Judged]) -> tuple[Finding, ...]:
    failed = [one.finding for one in judged if one.verdict is CheckVerdict.FAILED]
    elsewhere = [one for one in failed if one.code == LENGTH]
    # Points that lie wrong because the tip does say nothing about the ball.
    by_code = {one.code: one for one in reversed(elsewhere or failed)}
    return tuple(one for one in failed if one is by_code.get(one.code))


def _ball(
    touches: Sequence[RestingTouch],
    sphere: Sphere,
    rig: Rig,
    body: ProbeBody,
    temperature_c: float | None,
) -> BallFit | None:
    try:
        return fit_ball_on(touches, sphere, rig, body, temperature_c)
    except CalibrationError:
        return None


def _diameter(ball: BallFit, sigma: float, qualification: TipRecord) -> Judged:
    off = ball.diameter - qualification.diameter_mm
    check = Check(
        name="diameter of the ball",
        measured_mm=ball.diameter,
        certified_mm=qualification.diameter_mm,
        expanded_mm=2.0 * sigma,
        limit_mm=0.5 * DIAMETER_DEFECT_MM,
    )
    return Judged(
        check,
        DIAMETER_SIGMA_MM,
        Finding(
            "tip_check.diameter",
            f"The ball is {1e3 * abs(off):.0f} um {'larger' if off > 0.0 else 'smaller'} than "
            "at its qualification.",
            "Clean ball and sphere and check again. If it persists, confirm which tip is "
            "mounted, or qualify this one.",
            refuses=True,
        ),
    )


def _form(ball: BallFit) -> list[Judged]:
    named = ", ".join(str(point + 1) for point in ball.doubtful)
    which = f" Point {named} on the sphere does not fit." if named else ""
    return [
        Judged(
            check,
            np.inf,
            Finding(
                "tip_check.form",
                f"The points are not on one sphere: {check.name} is "
                f"{1e3 * check.measured_mm:.0f} um; their uncertainty explains "
                f"{1e3 * check.limit_mm:.0f} um.{which}",
                "Undo such a point and touch that place again with the ball resting on the "
                "sphere. If it persists, check the ball for wear.",
                refuses=True,
            ),
        )
        for check in form_checks(ball)
    ]


def _place(place: BallPlace, body: ProbeBody) -> list[Judged]:
    nominal = float((body.leds_probe.mean(axis=0) - body.tip_probe) @ handle_axis(body))
    limit = 0.5 * LENGTH_DEFECT_MM
    remedy = (
        "Confirm which tip is mounted and tighten it; if it is the right one, calibrate the "
        "probe with it again."
    )
    longer = "longer" if place.length_error > 0.0 else "shorter"
    return [
        Judged(
            Check(
                name="length to the ball",
                measured_mm=nominal + place.length_error,
                certified_mm=nominal,
                expanded_mm=2.0 * place.length_sigma,
                limit_mm=limit,
            ),
            limit / SIGMAS,
            Finding(
                LENGTH,
                f"The probe is {abs(place.length_error):.2f} mm {longer} than at its calibration.",
                remedy,
                refuses=True,
            ),
        ),
        Judged(
            Check(
                name="ball sideways",
                measured_mm=place.sideways,
                certified_mm=0.0,
                expanded_mm=2.0 * place.sideways_sigma,
                limit_mm=limit,
            ),
            limit / SIDEWAYS_SIGMAS,
            Finding(
                LENGTH,
                f"The ball is {place.sideways:.2f} mm sideways from its calibrated position.",
                remedy,
                refuses=True,
            ),
        ),
    ]


def _articulation(found: Articulation) -> Judged:
    return Judged(
        articulation_check(found),
        np.inf,
        Finding(
            "tip_check.articulation",
            f"The tip moves by {1e3 * found.spread_2s:.0f} um (2s) as the probe is turned about "
            f"it; its uncertainty explains {1e3 * found.spread_limit:.0f} um.",
            "Clean ball and cone, tighten tip and stylus, and check again. If it persists, "
            "calibrate the probe with this tip.",
            refuses=True,
        ),
    )


def never_conclusive(qualification: TipRecord) -> bool:
    """Return whether no check can be held against a qualification: it scatters too much itself."""
    own = qualification.noise_sigma_mm or qualification.diameter_sigma_mm
    return own >= DIAMETER_SIGMA_MM


def _more(unknown: Judged, qualification: TipRecord) -> str:
    sigma, quantity = 0.5 * unknown.check.expanded_mm, unknown.check.name
    said = (
        f"The {quantity} is known only to {1e3 * sigma:.1f} um; "
        f"{1e3 * unknown.sigma_wanted_mm:.1f} um are needed:"
    )
    if unknown.finding.code != "tip_check.diameter":
        return f"{said} hold the probe in more attitudes, leaning farther."
    if never_conclusive(qualification):
        return f"{said} the qualification itself is not accurate enough; qualify the tip again."
    return f"{said} take more points, at the equator, to the left and right."
