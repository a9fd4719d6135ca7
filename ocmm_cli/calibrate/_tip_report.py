"""Results on the terminal: a tip qualification or check, and a pivot calibration.

The pivot calibration has the tip by both methods, and changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

import numpy as np
from rich.text import Text

from ocmm_cli.terminal import (
    PlainConsole,
    error_text,
    heads,
    lead,
    print_grid,
    shown,
    tr,
    tr_later,
    tr_word,
)
from ocmm_core.calibration.pivot import PivotCalibration
from ocmm_core.calibration.records import Check, ProbeStore
from ocmm_core.calibration.sweeping import PivotOutcome
from ocmm_core.calibration.tip import TipCheckOutcome, TipCheckView, TipOutcome, TouchView
from ocmm_core.geometry import Float


def print_sphere(console: PlainConsole, view: TouchView) -> None:
    sphere = view.sphere
    console.show_line(
        f"Sphere   {view.sphere_name}: {view.sphere_diameter_mm:.4f} mm, "
        f"U = {1e3 * view.sphere_expanded_mm:.1f} um (k = 2)"
    )
    touched = len(sphere.places) - len(sphere.missing)
    known = tr("compared with the qualified one") if isinstance(view, TipCheckView) else tr("known")
    console.show_line(
        f"Points   {len(sphere.tips_world)}, at {touched} of {len(sphere.places)} places; ball "
        f"diameter {known}, U = {2e3 * sphere.diameter_sigma_mm:.1f} um (k = 2)"
    )
    for index in sphere.missing:
        console.print_line(f"         {tr('not touched:')} {sphere.places[index].name}")
    for point in sphere.doubtful:
        console.show_line(
            f"         point {point + 1} does not fit: {1e3 * sphere.residuals_mm[point]:+.0f} um"
        )


def print_cone(console: PlainConsole, view: TouchView) -> None:
    """Print the tip in every attitude."""
    cone = view.cone
    if len(cone.tips_world) < 2:
        return
    held = {one.point: one.name for one in cone.attitudes if one.point is not None}
    rows = [
        (
            held.get(number, "otherwise"), *(f"{value:+.1f}" for value in off),
            f"{np.linalg.norm(off):.1f}",
        )
        for number, off in enumerate(1e3 * cone.off_world)
    ]  # fmt: skip
    columns = heads("Probe", "dX um", "dY um", "dZ um", "Distance um")
    print_grid(console, columns, rows, tr_word("Ball in the cone"))
    x, y, z = 1e3 * cone.half_range_mm
    console.show_line(
        f"Articulation 2s {1e3 * cone.spread_2s_mm:.1f} um, largest {1e3 * cone.largest_mm:.1f} "
        f"um, (max - min) / 2 of X, Y, Z: {x:.1f}, {y:.1f}, {z:.1f} um"
    )


def print_qualification(console: PlainConsole, outcome: TipOutcome) -> None:
    record = outcome.record
    _print_checks(console, "Qualification", record.checks)
    console.show_line(
        f"Ball     {record.diameter_mm:.4f} mm, U = {2e3 * record.diameter_sigma_mm:.1f} um (k = "
        f"2); form {1e3 * record.form_mm:.1f} um, one point {1e3 * record.point_sigma_mm:.1f} um "
        "(standard deviation)"
    )
    if outcome.previous is not None:
        change = record.diameter_mm - outcome.previous.diameter_mm
        console.show_line(
            f"         {1e3 * change:+.1f} um since {outcome.previous.made_utc[:10]} by "
            f"{outcome.previous.made_by}"
        )
    print_term(console, record.valid_until_utc)
    for warning in outcome.warnings:
        console.print(error_text(warning), style="yellow")
    print_passed(console, passed=record.passed)


def print_check(console: PlainConsole, outcome: TipCheckOutcome) -> None:
    _print_checks(console, tr("Quick check"), outcome.record.checks)
    for finding in outcome.findings:
        console.print(error_text(finding), style="red")
    for warning in outcome.warnings:
        console.print(error_text(warning), style="yellow")
    if outcome.record.passed:
        print_term(console, outcome.due_utc)
    print_passed(console, passed=outcome.record.passed)


def print_term(console: PlainConsole, until_utc: str) -> None:
    """Print the last day of validity, in local time."""
    day = datetime.fromisoformat(until_utc).astimezone().date()
    console.show_line(f"Valid    until {day}")


def _print_checks(console: PlainConsole, title: str, checks: Sequence[Check]) -> None:
    rows = []
    for check in checks:
        bad = abs(check.error_mm) > check.limit_mm
        cells = (
            check.name, f"{check.certified_mm:.4f}", f"{check.measured_mm:.4f}",
            f"{1e3 * check.error_mm:+.1f}",
            f"{1e3 * check.expanded_mm:.1f}" if check.expanded_mm else "",
            f"{1e3 * check.limit_mm:.1f}",
        )  # fmt: skip
        rows.append([Text(shown(cell), "bold red" if bad else "") for cell in cells])
    columns = heads("Check", "Expected", "Measured", "E um", "U um", "Limit um")
    print_grid(console, columns, rows, title)


def print_passed(console: PlainConsole, *, passed: bool) -> None:
    verdict = ("PASSED", "green") if passed else ("FAILED", "bold red")
    console.print(Text.assemble("Verdict  ", verdict))


def print_probe(console: PlainConsole, outcome: PivotOutcome) -> None:
    _print_tips(console, outcome)
    _print_leds(console, outcome)
    for name, found in ((tr("First sweep"), outcome.first), (tr("Second sweep"), outcome.second)):
        _print_sweep(console, name, found)
    _print_validation(console, outcome)
    for finding in outcome.findings:
        console.print(error_text(finding), style="yellow")
    _print_change(console, outcome)


def print_tip_status(console: PlainConsole, store: ProbeStore, tip: str, now: datetime) -> None:
    """Print the state of a tip if it was ever calibrated."""
    store.refresh()
    if tip not in store.tips:
        return
    status = store.status(tip, now)
    why = f"{tr(status.reason)} {tr(status.remedy)}"
    console.print(f"{lead('Tip      ')}{tip}: {tr_word(status.state.value)}. {why}".rstrip())


def _print_tips(console: PlainConsole, outcome: PivotOutcome) -> None:
    record, first = outcome.record, outcome.first
    expanded = [f"{2e3 * sigma:.1f}" for sigma in np.sqrt(np.diag(first.tip_covariance))]
    spread = f"{1e3 * first.thesis.spread:.1f}"
    print_grid(
        console,
        heads("Method", "x mm", "y mm", "z mm", "U x um", "U y um", "U z um", "Spread um"),
        [
            (tr("adjustment"), *_mm(first.tip_probe), *expanded, ""),
            (tr("thesis"), *_mm(first.thesis_tip_probe), "", "", "", spread),
        ],
        tr(f"Probe {record.probe}, tip {record.tip}: tip position, probe frame"),
    )
    console.show(
        "U: k = 2. Spread: RMS distance of the centres of the LEDs' spheres from their mean "
        "(thesis, Table 4).",
        style="dim",
    )


def _print_leds(console: PlainConsole, outcome: PivotOutcome) -> None:
    first = outcome.first
    rows = []
    sigmas = np.sqrt(np.diag(first.covariance)[: first.leds_probe.size]).reshape(-1, 3)
    for led, (place, sigma, off) in enumerate(
        zip(first.leds_probe, sigmas, first.thesis.deviations, strict=True), start=1
    ):
        rows.append((
            str(led), *_mm(place), f"{2e3 * float(np.linalg.norm(sigma)):.1f}",
            *(f"{1e3 * value:+.1f}" for value in off),
        ))  # fmt: skip
    columns = heads(
        "LED", "x mm", "y mm", "z mm", "U um", "Its centre, thesis: dx um", "dy um", "dz um"
    )
    print_grid(console, columns, rows)


def _print_sweep(console: PlainConsole, name: str, found: PivotCalibration) -> None:
    ranges = ", ".join(f"{value:.0f}" for value in np.degrees(found.coverage.ranges))
    console.show(
        f"{name}: {len(found.used)} poses, {found.coverage.attitudes} attitudes, turned by "
        f"{ranges} degrees, residuals {found.rms_px:.4f} px RMS, chi-square "
        f"{found.chi2 / found.dof:.2f} per degree of freedom, {len(found.left_out)} left out."
    )
    for one in found.left_out[:5]:
        console.show(f"  left out: pose {one.frame}, {tr(_WORDS[one.reason])}")
    if len(found.left_out) > 5:
        console.show(f"  and {len(found.left_out) - 5:d} more")


def _print_validation(console: PlainConsole, outcome: PivotOutcome) -> None:
    check = outcome.validation
    off = ", ".join(f"{value:+.1f}" for value in 1e3 * check.tip_difference)
    sigma = ", ".join(f"{value:.1f}" for value in 2e3 * check.tip_difference_sigma)
    console.show(
        f"Second against first: tip {off} um (U {sigma}), LEDs {1e3 * check.led_difference:.1f} um "
        f"RMS, cone {check.place_distance:.0f} mm and attitude "
        f"{np.degrees(check.attitude_distance):.0f} degrees apart."
    )
    if np.isfinite(check.articulation_2s):
        console.show(
            f"Articulation of the tip in the second sweep: 2s {1e3 * check.articulation_2s:.1f} "
            f"um, largest {1e3 * check.articulation_max:.1f} um."
        )


def _print_change(console: PlainConsole, outcome: PivotOutcome) -> None:
    change = outcome.change
    if change is None:
        console.show("Change   none: the first calibration of this tip.")
        return
    off = ", ".join(f"{value:+.1f}" for value in 1e3 * change.tip_difference)
    console.show(
        f"Change   tip {1e3 * change.tip_distance:.1f} um ({off}), LEDs {1e3 * change.led_rms:.1f} "
        f"um RMS since {change.previous.made_utc[:10]}; limit {1e3 * change.limit_mm:.0f} um.",
        style="bold yellow" if change.must_be_confirmed else "",
    )


_WORDS = {
    "few": tr_later("fewer than three LEDs seen by two cameras"),
    "spots": tr_later("its spots do not fit the probe"),
    "tip": tr_later("it places the ball elsewhere"),
}


def _mm(place: Float) -> list[str]:
    return [f"{value:.4f}" for value in place]
