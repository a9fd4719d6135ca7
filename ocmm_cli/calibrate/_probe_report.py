"""Results of a pivot calibration on the terminal: tip by both methods, changes."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from ocmm_cli.terminal import heads, lead, say, say_later, say_word, told
from ocmm_core.calibration.pivot import PivotCalibration
from ocmm_core.calibration.records import ProbeStore
from ocmm_core.calibration.sweeping import PivotOutcome
from ocmm_core.geometry import Float


def print_probe(console: Console, outcome: PivotOutcome) -> None:
    _print_tips(console, outcome)
    _print_leds(console, outcome)
    for name, found in ((say("First sweep"), outcome.first), (say("Second sweep"), outcome.second)):
        _print_sweep(console, name, found)
    _print_validation(console, outcome)
    for finding in outcome.findings:
        console.print(told(finding), style="yellow", highlight=False)
    _print_change(console, outcome)


def print_tip_status(console: Console, store: ProbeStore, tip: str, now: datetime) -> None:
    """Print the state of a tip if it was ever calibrated."""
    if tip not in store.tips:
        return
    status = store.status(tip, now)
    why = f"{say(status.reason)} {say(status.remedy)}"
    console.print(
        f"{lead('Tip      ')}{tip}: {say_word(status.state.value)}. {why}".rstrip(), highlight=False
    )


def _print_tips(console: Console, outcome: PivotOutcome) -> None:
    record, first = outcome.record, outcome.first
    table = Table(
        title=say(f"Probe {record.probe}, tip {record.tip}: tip position, probe frame"),
        title_justify="left",
        box=box.SIMPLE_HEAD,
    )
    table.add_column(say_word("Method"), no_wrap=True)
    for name in heads("x mm", "y mm", "z mm", "U x um", "U y um", "U z um", "Spread um"):
        table.add_column(name, justify="right", no_wrap=True)
    expanded = [f"{2e3 * sigma:.1f}" for sigma in np.sqrt(np.diag(first.tip_covariance))]
    table.add_row(say("adjustment"), *_mm(first.tip_probe), *expanded, "")
    table.add_row(
        say("thesis"), *_mm(first.thesis_tip_probe), "", "", "", f"{1e3 * first.thesis.spread:.1f}"
    )
    console.print(table)
    console.print(
        say(
            "U: k = 2. Spread: RMS distance of the centres of the LEDs' spheres from their mean "
            "(thesis, Table 4)."
        ),
        style="dim",
        highlight=False,
    )


def _print_leds(console: Console, outcome: PivotOutcome) -> None:
    first = outcome.first
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column(say_word("LED"), justify="right")
    for name in heads(
        "x mm", "y mm", "z mm", "U um", "Its centre, thesis: dx um", "dy um", "dz um"
    ):
        table.add_column(name, justify="right", no_wrap=True)
    sigmas = np.sqrt(np.diag(first.covariance)[: first.leds_probe.size]).reshape(-1, 3)
    for led, (place, sigma, off) in enumerate(
        zip(first.leds_probe, sigmas, first.thesis.deviations, strict=True), start=1
    ):
        table.add_row(
            str(led), *_mm(place), f"{2e3 * float(np.linalg.norm(sigma)):.1f}",
            *(f"{1e3 * value:+.1f}" for value in off),
        )  # fmt: skip
    console.print(table)


def _print_sweep(console: Console, name: str, found: PivotCalibration) -> None:
    ranges = ", ".join(f"{value:.0f}" for value in np.degrees(found.coverage.ranges))
    console.print(
        say(
            f"{name}: {len(found.used)} poses, {found.coverage.attitudes} attitudes, turned by "
            f"{ranges} degrees, residuals {found.rms_px:.4f} px RMS, chi-square "
            f"{found.chi2 / found.dof:.2f} per degree of freedom, {len(found.left_out)} left out."
        ),
        highlight=False,
    )
    for one in found.left_out[:5]:
        console.print(
            say(f"  left out: pose {one.frame}, {say(_WORDS[one.reason])}"), highlight=False
        )
    if len(found.left_out) > 5:
        console.print(say(f"  and {len(found.left_out) - 5:d} more"), highlight=False)


def _print_validation(console: Console, outcome: PivotOutcome) -> None:
    check = outcome.validation
    off = ", ".join(f"{value:+.1f}" for value in 1e3 * check.tip_difference)
    sigma = ", ".join(f"{value:.1f}" for value in 2e3 * check.tip_difference_sigma)
    console.print(
        say(
            f"Second against first: tip {off} um (U {sigma}), LEDs "
            f"{1e3 * check.led_difference:.1f} um "
            f"RMS, cone {check.place_distance:.0f} mm and attitude "
            f"{np.degrees(check.attitude_distance):.0f} degrees apart."
        ),
        highlight=False,
    )
    if np.isfinite(check.articulation_2s):
        console.print(
            say(
                f"Articulation of the tip in the second sweep: 2s "
                f"{1e3 * check.articulation_2s:.1f} "
                f"um, largest {1e3 * check.articulation_max:.1f} um."
            ),
            highlight=False,
        )


def _print_change(console: Console, outcome: PivotOutcome) -> None:
    change = outcome.change
    if change is None:
        console.print(say("Change   none: the first calibration of this tip."), highlight=False)
        return
    off = ", ".join(f"{value:+.1f}" for value in 1e3 * change.tip_difference)
    console.print(
        say(
            f"Change   tip {1e3 * change.tip_distance:.1f} um ({off}), LEDs "
            f"{1e3 * change.led_rms:.1f} um RMS since {change.previous.made_utc[:10]}; limit "
            f"{1e3 * change.limit_mm:.0f} um."
        ),
        style="bold yellow" if change.must_be_confirmed else "",
        highlight=False,
    )


_WORDS = {
    "few": say_later("fewer than three LEDs seen by two cameras"),
    "spots": say_later("its spots do not fit the probe"),
    "tip": say_later("it places the ball elsewhere"),
}


def _mm(place: Float) -> list[str]:
    return [f"{value:.4f}" for value in place]
