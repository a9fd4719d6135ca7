"""Results of a tip qualification or check on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ocmm_cli.terminal import heads, say, say_word, told
from ocmm_core.calibration.records import Check
from ocmm_core.calibration.tip import TipCheckOutcome, TipCheckView, TipOutcome, TouchView


def print_sphere(console: Console, view: TouchView) -> None:
    sphere = view.sphere
    _say(
        console,
        say(
            f"Sphere   {view.sphere_name}: {view.sphere_diameter_mm:.4f} mm, "
            f"U = {1e3 * view.sphere_expanded_mm:.1f} um (k = 2)"
        ),
    )
    touched = len(sphere.places) - len(sphere.missing)
    known = (
        say("compared with the qualified one") if isinstance(view, TipCheckView) else say("known")
    )
    _say(
        console,
        say(
            f"Points   {len(sphere.tips_world)}, at {touched} of {len(sphere.places)} places; ball "
            f"diameter {known}, U = {2e3 * sphere.diameter_sigma_mm:.1f} um (k = 2)"
        ),
    )
    for index in sphere.missing:
        _say(console, f"         {say('not touched:')} {sphere.places[index].name}")
    for point in sphere.doubtful:
        _say(
            console,
            say(
                f"         point {point + 1} does not fit: "
                f"{1e3 * sphere.residuals_mm[point]:+.0f} um"
            ),
        )


def print_cone(console: Console, view: TouchView) -> None:
    """Print the tip in every attitude."""
    cone = view.cone
    if len(cone.tips_world) < 2:
        return
    table = Table(title=say_word("Ball in the cone"), title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column(say_word("Probe"), no_wrap=True)
    for name in heads("dX um", "dY um", "dZ um", "Distance um"):
        table.add_column(name, justify="right", no_wrap=True)
    held = {one.point: one.name for one in cone.attitudes if one.point is not None}
    for number, off in enumerate(1e3 * cone.off_world):
        table.add_row(
            held.get(number, "otherwise"), *(f"{value:+.1f}" for value in off),
            f"{np.linalg.norm(off):.1f}",
        )  # fmt: skip
    console.print(table)
    x, y, z = 1e3 * cone.half_range_mm
    _say(
        console,
        say(
            f"Articulation 2s {1e3 * cone.spread_2s_mm:.1f} um, largest "
            f"{1e3 * cone.largest_mm:.1f} um, (max - min) / 2 of X, Y, Z: {x:.1f}, {y:.1f}, "
            f"{z:.1f} um"
        ),
    )


def print_qualification(console: Console, outcome: TipOutcome) -> None:
    record = outcome.record
    _print_checks(console, "Qualification", record.checks)
    _say(
        console,
        say(
            f"Ball     {record.diameter_mm:.4f} mm, U = {2e3 * record.diameter_sigma_mm:.1f} um "
            f"(k = 2); form {1e3 * record.form_mm:.1f} um, one point "
            f"{1e3 * record.point_sigma_mm:.1f} "
            f"um (standard deviation)"
        ),
    )
    if outcome.previous is not None:
        change = record.diameter_mm - outcome.previous.diameter_mm
        _say(
            console,
            say(
                f"         {1e3 * change:+.1f} um since {outcome.previous.made_utc[:10]} by "
                f"{outcome.previous.made_by}"
            ),
        )
    print_term(console, record.valid_until_utc)
    for warning in outcome.warnings:
        console.print(told(warning), style="yellow", highlight=False)
    print_passed(console, passed=record.passed)


def print_check(console: Console, outcome: TipCheckOutcome) -> None:
    _print_checks(console, say("Quick check"), outcome.record.checks)
    for finding in outcome.findings:
        console.print(told(finding), style="red", highlight=False)
    for warning in outcome.warnings:
        console.print(told(warning), style="yellow", highlight=False)
    if outcome.record.passed:
        print_term(console, outcome.due_utc)
    print_passed(console, passed=outcome.record.passed)


def print_term(console: Console, until_utc: str) -> None:
    """Print the last day of validity, in local time."""
    day = datetime.fromisoformat(until_utc).astimezone().date()
    _say(console, say(f"Valid    until {day}"))


def _print_checks(console: Console, title: str, checks: Sequence[Check]) -> None:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column(say_word("Check"), no_wrap=True)
    for name in heads("Expected", "Measured", "E um", "U um", "Limit um"):
        table.add_column(name, justify="right", no_wrap=True)
    for check in checks:
        bad = abs(check.error_mm) > check.limit_mm
        table.add_row(
            check.name, f"{check.certified_mm:.4f}", f"{check.measured_mm:.4f}",
            f"{1e3 * check.error_mm:+.1f}",
            f"{1e3 * check.expanded_mm:.1f}" if check.expanded_mm else "",
            f"{1e3 * check.limit_mm:.1f}", style="bold red" if bad else None,
        )  # fmt: skip
    console.print(table)


def print_passed(console: Console, *, passed: bool) -> None:
    verdict = ("PASSED", "green") if passed else ("FAILED", "bold red")
    console.print(Text.assemble("Verdict  ", verdict))


def _say(console: Console, text: str) -> None:
    console.print(text, highlight=False, soft_wrap=True)
