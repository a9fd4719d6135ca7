"""What ``ocmm fit`` says of an element: one list of numbers for the table and for JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.uncertainty import FitUncertainty, Stated

_AXIS = (Shape.CYLINDER, Shape.CONE, Shape.TORUS)
_RADII = {
    Shape.CIRCLE: (("Diameter", "diameter"), None),
    Shape.SPHERE: (("Diameter", "diameter"), None),
    Shape.CYLINDER: (("Diameter", "diameter"), None),
    Shape.CONE: (("Diameter there", "diameter"), None),
    Shape.TORUS: (
        ("Diameter of the centre line", "ring_diameter"),
        ("Diameter of the tube", "tube_diameter"),
    ),
    Shape.ELLIPSE: (("Long axis", "length"), ("Short axis", "width")),
    Shape.ROUND_SLOT: (("Length", "length"), ("Width", "width")),
    Shape.SQUARE_SLOT: (("Length", "length"), ("Width", "width")),
    Shape.RECTANGLE: (("Length", "length"), ("Width", "width")),
}
_FEET = {
    Shape.LINE: "Point on it",
    Shape.PLANE: "Point on it",
    Shape.CYLINDER: "Point of the axis",
    Shape.CONE: "Point of the axis",
}


@dataclass(frozen=True, slots=True)
class Row:
    """One number of an element, or a vector.

    Attributes
    ----------
    words, key
        For people, and for programs.
    values
        One or three, in ``unit``; a direction has none.
    unit
        mm, deg or empty.
    stated
        What is known of its uncertainty, in ``stated_unit``; None where nothing is.
    factor
        From the numbers of ``stated`` to ``stated_unit``.
    """

    words: str
    key: str
    values: tuple[float, ...]
    unit: str
    stated: Stated | None
    stated_unit: str
    factor: float = 1.0

    @property
    def expanded(self) -> float | None:
        """Return U in its unit; None where there is none."""
        if self.stated is None or self.stated.expanded is None:
            return None
        return self.factor * self.stated.expanded


def rows_of(fit: Fit, found: FitUncertainty | None) -> list[Row]:
    """Return everything that the shape has, with its uncertainty."""
    rows = []
    if fit.shape in _FEET:
        foot = None if found is None else found.foot
        rows.append(Row(_FEET[fit.shape], "point", _vector(fit.point), "mm", foot, "mm"))
    else:
        word = "Point" if fit.shape is Shape.POINT else "Centre"
        for k, axis in enumerate("xyz"):
            own = None if found is None or found.centre is None else found.centre[k]
            rows.append(
                Row(f"{word} {axis}", f"centre_{axis}", (float(fit.point[k]),), "mm", own, "mm")
            )
    if fit.direction.any():
        word, key = ("Axis", "axis") if fit.shape in _AXIS else ("Normal", "normal")
        word, key = ("Direction", "direction") if fit.shape is Shape.LINE else (word, key)
        own = None if found is None else found.direction
        rows.append(Row(word, key, _vector(fit.direction), "", own, "rad"))
    if fit.across.any():
        own = None if found is None else found.turn
        rows.append(Row("Direction of its length", "across", _vector(fit.across), "", own, "rad"))
    first, second = _RADII.get(fit.shape, (None, None))
    if first is not None:
        own = None if found is None else found.radius
        rows.append(Row(*first, (2.0 * fit.radius,), "mm", own, "mm", 2.0))
    if second is not None:
        own = None if found is None else found.second
        rows.append(Row(*second, (2.0 * fit.second,), "mm", own, "mm", 2.0))
    if fit.shape is Shape.CONE:
        factor = float(np.degrees(2.0))
        own = None if found is None else found.half_angle
        rows.append(
            Row("Full angle", "full_angle", (factor * fit.half_angle,), "deg", own, "deg", factor)
        )
    tube = fit.free and fit.criterion is Criterion.MINIMUM_ZONE
    word = "diameter of the tube about it" if tube else "peak to valley"
    rows.append(Row(f"Form ({word})", "form", (fit.form,), "mm", None, ""))
    rows.append(Row("RMS of the residuals", "rms", (fit.rms,), "mm", None, ""))
    return rows


def _vector(vector: Float) -> tuple[float, ...]:
    return tuple(float(value) for value in vector)
