"""``ocmm fit``: one element through the points of a text file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich import box
from rich.console import Console
from rich.table import Table

from ocmm_core.cli.headless import make_console
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.fit import fit_shape, sizes_in_words
from ocmm_core.features.outliers import outliers
from ocmm_core.features.points_file import read_points_file
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    MINIMUM_POINTS,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    Fit,
    Shape,
)
from ocmm_core.geometry import Float

COVERAGE = 2.0
"""Coverage factor of the printed uncertainties."""

LISTED = 20
"""Outliers that are printed one by one."""

AMBIGUOUS = (Shape.CYLINDER, Shape.CONE, Shape.TORUS, Shape.SQUARE_SLOT, Shape.RECTANGLE)


class ShapeWord(StrEnum):
    """Shapes on the command line."""

    POINT = "point"
    LINE = "line"
    PLANE = "plane"
    CIRCLE = "circle"
    SPHERE = "sphere"
    CYLINDER = "cylinder"
    ELLIPSE = "ellipse"
    ROUND_SLOT = "round-slot"
    SQUARE_SLOT = "square-slot"
    RECTANGLE = "rectangle"
    CONE = "cone"
    TORUS = "torus"


class CriterionWord(StrEnum):
    """Criteria on the command line."""

    LEAST_SQUARES = "least-squares"
    MINIMUM_ZONE = "minimum-zone"
    INSCRIBED = "inscribed"
    CIRCUMSCRIBED = "circumscribed"


_RADII = {
    Shape.CIRCLE: ("Diameter", ""),
    Shape.SPHERE: ("Diameter", ""),
    Shape.CYLINDER: ("Diameter", ""),
    Shape.CONE: ("Diameter there", ""),
    Shape.TORUS: ("Diameter of the centre line", "Diameter of the tube"),
    Shape.ELLIPSE: ("Long axis", "Short axis"),
    Shape.ROUND_SLOT: ("Length", "Width"),
    Shape.SQUARE_SLOT: ("Length", "Width"),
    Shape.RECTANGLE: ("Length", "Width"),
}
_PARAMETERS = {**MINIMUM_POINTS, Shape.POINT: 3, Shape.LINE: 4}
"""How many numbers the residuals determine; those of a circle leave its plane out."""
_OF_FREE_CIRCLE = 6
"""The same of a circle in space, whose residuals are the whole distances."""
_POINTS = {
    Shape.LINE: "Point on it",
    Shape.PLANE: "Point on it",
    Shape.CYLINDER: "Point of the axis",
    Shape.CONE: "Point of the axis",
}


def fit_command(
    file: Annotated[
        Path, typer.Argument(help="Text file, a row x y z in mm for every point.", metavar="FILE")
    ],
    shape: Annotated[ShapeWord, typer.Option("--shape", help="What to fit.")],
    criterion: Annotated[
        CriterionWord, typer.Option("--criterion", help="How it is associated with the points.")
    ] = CriterionWord.LEAST_SQUARES,
    free: Annotated[
        bool,
        typer.Option("--free", help="Circle: fit in space as one problem, not plane first."),
    ] = False,
) -> None:
    """Fit one element to points and print it with its form, uncertainty and outliers.

    The points are taken as they are: no ball is taken off. The uncertainty is what the scatter of
    the residuals says, as if it were random and equal everywhere; it knows nothing of the measuring
    system.
    """
    wanted = Shape[shape.name]
    if free and wanted is not Shape.CIRCLE:
        raise InputError(
            "fit.free", f"--free is for circles, not for a {shape.value}.", "Leave it out."
        )
    if free and criterion in (CriterionWord.INSCRIBED, CriterionWord.CIRCUMSCRIBED):
        raise InputError(
            "fit.free", "--free goes with least-squares and minimum-zone only.", "Leave one out."
        )
    held = read_points_file(file)
    points = held.points
    try:
        fit = fit_shape(wanted, points, criterion=Criterion[criterion.name], free=free)
    except FitError as error:
        raise FitError(error.code, f"{file}: {error.what}", error.remedy) from error
    console = make_console()
    if held.unit != "mm":
        console.print(
            f"[yellow]The file names the unit {held.unit}: all numbers are in mm, "
            f"{held.factor:g} times those of the file.[/]",
            highlight=False,
        )
    _print_fit(console, fit, len(points), criterion, free=free)
    if fit.criterion is Criterion.LEAST_SQUARES:
        _print_outliers(console, fit, points)
    _print_rival(console, fit)
    if fit.rival is None and wanted in AMBIGUOUS and len(points) <= MINIMUM_POINTS[wanted]:
        console.print(
            f"[yellow]{len(points)} points are as few as a {shape.value} needs: others may pass "
            "through them as well. Take more points.[/]",
            highlight=False,
        )


def _print_fit(
    console: Console, fit: Fit, n: int, criterion: CriterionWord, *, free: bool
) -> None:
    how = f"{criterion.value} ({fit.criterion.value})" + (", one problem in space" if free else "")
    table = Table(
        title=f"{fit.shape.value} through {n} points, {how}",
        title_justify="left",
        box=box.SIMPLE_HEAD,
    )
    table.add_column("")
    table.add_column("Value", justify="right", no_wrap=True)
    table.add_column("U (k=2)", justify="right", no_wrap=True)
    expanded = _expanded(fit, n)
    for name, value, own, unit in _rows(fit, expanded):
        table.add_row(name, value, "–" if own is None else f"{own:.2g} {unit}")
    console.print(table)
    if fit.contacts:
        rows = ", ".join(str(row + 1) for row in fit.contacts)
        console.print(f"Held by points {rows} (rows of the file, counted from 1).")
    if expanded is None:
        console.print(
            "No uncertainty: it follows from the residuals of least squares with more points than "
            "determine the element.",
            style="dim",
        )


def _rows(fit: Fit, expanded: Float | None) -> list[tuple[str, str, float | None, str]]:
    """Return name, value, expanded uncertainty and its unit of everything the shape has."""

    def length(place: slice) -> float | None:
        return None if expanded is None else float(np.linalg.norm(expanded[place]))

    def own(place: int, factor: float = 1.0) -> float | None:
        return None if expanded is None else factor * float(expanded[place])

    rows = [(_POINTS.get(fit.shape, "Centre"), _vector(fit.point, 9), length(POINT), "mm")]
    if fit.direction.any():
        word = "Axis" if fit.shape in (Shape.CYLINDER, Shape.CONE, Shape.TORUS) else "Normal"
        word = "Direction" if fit.shape is Shape.LINE else word
        rows.append((word, _vector(fit.direction, 12), length(DIRECTION), "rad"))
    if fit.across.any():
        rows.append(("Direction of its length", _vector(fit.across, 12), length(ACROSS), "rad"))
    first, second = _RADII.get(fit.shape, ("", ""))
    if first:
        rows.append((first, f"{2.0 * fit.radius:.9f}", own(RADIUS, 2.0), "mm"))
    if second:
        rows.append((second, f"{2.0 * fit.second:.9f}", own(SECOND, 2.0), "mm"))
    if fit.shape is Shape.CONE:
        angle = 2.0 * np.degrees(fit.half_angle)
        rows.append(("Full angle", f"{angle:.9f}", own(HALF_ANGLE, float(np.degrees(2.0))), "deg"))
    tube = fit.free and fit.criterion is Criterion.MINIMUM_ZONE
    word = "diameter of the tube about it" if tube else "peak to valley"
    rows.append((f"Form ({word})", f"{fit.form:.9f}", None, ""))
    rows.append(("RMS of the residuals", f"{fit.rms:.9f}", None, ""))
    return rows


def _expanded(fit: Fit, n: int) -> Float | None:
    """Return expanded uncertainties (12,) of the geometry from the scatter of the residuals."""
    # A point and a line in space have residuals with several components each.
    components = 2 if fit.free else {Shape.POINT: 3, Shape.LINE: 2}.get(fit.shape, 1)
    freedom = components * n - (_OF_FREE_CIRCLE if fit.free else _PARAMETERS[fit.shape])
    if fit.criterion is not Criterion.LEAST_SQUARES or freedom < 1:
        return None
    sigma = np.sqrt(np.sum(fit.residuals**2) / freedom)
    expanded: Float = COVERAGE * sigma * np.linalg.norm(fit.jacobian, axis=1)
    return expanded


def _print_outliers(console: Console, fit: Fit, points: Float) -> None:
    found = outliers(fit, points)
    for row in found[:LISTED]:
        console.print(
            f"[yellow]Outlier: point {row + 1} lies {fit.residuals[row]:+.6f} mm off; it is in the "
            "fit all the same.[/]",
            highlight=False,
        )
    if len(found) > LISTED:
        console.print(f"[yellow]{len(found) - LISTED} more outliers.[/]", highlight=False)
    if not found:
        console.print("No outliers.", style="dim")


def _print_rival(console: Console, fit: Fit) -> None:
    """Print that the points fit another element as well, and which one."""
    if fit.rival is None:
        return
    console.print(
        "[bold red]AMBIGUOUS:[/] the points fit two elements, and their noise cannot decide which "
        "one it is. Use neither; take more points, spread over more of the feature.",
        highlight=False,
    )
    for word, one in (("The one above:", fit), ("The other one:", fit.rival)):
        centre = ", ".join(f"{value:.6f}" for value in one.point)
        console.print(
            f"{word} {sizes_in_words(one)}, at {centre}; rms of the residuals {one.rms:.9f} mm.",
            highlight=False,
        )


def _vector(vector: Float, digits: int) -> str:
    return "  ".join(f"{value:.{digits}f}" for value in vector)
