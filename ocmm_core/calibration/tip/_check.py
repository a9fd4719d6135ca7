"""Decision of a quick check: PASSED, FAILED or INCONCLUSIVE.

It must find a diameter error of `DIAMETER_DEFECT_MM` with few false alarms. The limit is half of
the defect; both error probabilities are small if the uncertainty is below a seventh of it.
Otherwise it is inconclusive and requires more points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Check, Finding, Sphere, TipRecord
from ocmm_core.calibration.tip._fit import BallFit, fit_ball_on, sigma_of_difference
from ocmm_core.calibration.tip._qualification import articulation_check, form_checks
from ocmm_core.calibration.tip._views import CheckVerdict
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

DIAMETER_DEFECT_MM = 0.050
LENGTH_DEFECT_MM = 0.200
"""Smallest defects to be found. A length error of 1 mm is five times larger."""

SIGMAS = 3.5
"""From zero to the limit, and from the limit to the defect: error probability 1 in 2,000 each."""

SIDEWAYS_SIGMAS = 4.3
"""The same for a distance in a plane, which is never negative."""

LENGTH = "tip_check.length"
"""Code of findings on a displaced ball."""

DIAMETER_SIGMA_MM = 0.5 * DIAMETER_DEFECT_MM / SIGMAS
"""Largest conclusive standard uncertainty of the difference from the qualified diameter."""

CHANCE = 1e-4
"""Probability that form or articulation of a good tip exceed their limits."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One quantity of a check."""

    check: Check
    sigma_wanted_mm: float
    """Largest conclusive standard uncertainty; infinite if always conclusive."""
    finding: Finding
    """For a failed check."""

    @property
    def verdict(self) -> CheckVerdict:
        size, sigma = abs(self.check.error_mm), 0.5 * self.check.expanded_mm
        if sigma <= self.sigma_wanted_mm:
            return CheckVerdict.PASSED if size <= self.check.limit_mm else CheckVerdict.FAILED
        # An error that no such uncertainty explains is real even if its size is uncertain.
        beyond = size * self.sigma_wanted_mm > self.check.limit_mm * sigma
        return CheckVerdict.FAILED if beyond else CheckVerdict.INCONCLUSIVE


@dataclass(frozen=True, slots=True)
class TipCheckDecision:
    """Decision from all quantities."""

    verdict: CheckVerdict
    """FAILED if any failed; else INCONCLUSIVE if any is; else PASSED."""
    judged: tuple[Judged, ...]
    advice: str
    """Why it is not PASSED and what to do, or empty."""
    ball: BallFit | None
    """None with too few points."""
    articulation: guided.Articulation | None
    place: guided.BallPlace | None
    """`articulation`, `place`: None with too few attitudes."""

    @property
    def checks(self) -> tuple[Check, ...]:
        return tuple(one.check for one in self.judged)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return the failures; only the cause if a displaced tip explains the rest."""
        return _causes(self.judged)


def decide_check(
    on_sphere: Sequence[guided.RestingTouch],
    in_cone: Sequence[guided.RestingTouch],
    sphere: Sphere,
    qualification: TipRecord,
    rig: Rig,
    body: ProbeBody,
    temperature: Temperature | None,
) -> TipCheckDecision:
    """Return the decision from the points of a complete or incomplete check."""
    judged: list[Judged] = []
    lacking = ""
    ball = _ball(on_sphere, sphere, rig, body, temperature)
    if ball is None:
        lacking = "The points on the sphere do not determine the ball yet: touch more places."
    else:
        sigma = sigma_of_difference(ball.errors, sphere, temperature, qualification, rig, body)
        judged += [_diameter(ball, sigma, qualification), *_form(ball)]
    place = guided.place_of_ball(in_cone, rig, body)
    articulation = guided.articulate(in_cone, rig, body, CHANCE) if len(in_cone) > 1 else None
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
    # Points displaced with the tip give no evidence on the ball.
    by_code = {one.code: one for one in reversed(elsewhere or failed)}
    return tuple(one for one in failed if one is by_code.get(one.code))


def _ball(
    touches: Sequence[guided.RestingTouch],
    sphere: Sphere,
    rig: Rig,
    body: ProbeBody,
    temperature: Temperature | None,
) -> BallFit | None:
    try:
        return fit_ball_on(touches, sphere, rig, body, temperature)
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


def _place(place: guided.BallPlace, body: ProbeBody) -> list[Judged]:
    nominal = float((body.leds_probe.mean(axis=0) - body.tip_probe) @ guided.handle_axis(body))
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


def _articulation(found: guided.Articulation) -> Judged:
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
    """Return whether a qualification scatters too much for any check to be conclusive."""
    own = qualification.noise_sigma_mm or qualification.diameter_sigma_mm
    return own >= DIAMETER_SIGMA_MM


def _more(unknown: Judged, qualification: TipRecord) -> str:
    sigma, quantity = 0.5 * unknown.check.expanded_mm, unknown.check.name
    said = (
        f"U of the {quantity} (k = 2) is {2e3 * sigma:.1f} um; "
        f"{2e3 * unknown.sigma_wanted_mm:.1f} um are needed:"
    )
    if unknown.finding.code != "tip_check.diameter":
        return f"{said} hold the probe in more attitudes, leaning farther."
    if never_conclusive(qualification):
        return f"{said} the qualification itself is not accurate enough; qualify the tip again."
    return f"{said} take more points, at the equator, to the left and right."
