"""Results of ``ocmm fit``: one list of numbers for the table and for JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_cli.terminal import say, say_word
from ocmm_core.features.shapes import HALF_ANGLE, RADIUS, SECOND, Criterion, Fit
from ocmm_core.geometry import Float
from ocmm_core.tolerances.uncertainty import FitUncertainty, Stated


@dataclass(frozen=True, slots=True)
class FitRow:
    """One number of an element, or a vector."""

    words: str
    key: str
    """`words`, `key`: For people, and for programs."""
    values: tuple[float, ...]
    """One or three, in ``unit``; a direction has none."""
    unit: str
    """mm, deg or empty."""
    stated: Stated | None
    """Its uncertainty in ``stated_unit``; None if unknown."""
    stated_unit: str
    factor: float = 1.0

    @property
    def expanded(self) -> float | None:
        """Return U in ``unit``; None if not stated."""
        if self.stated is None or self.stated.expanded is None:
            return None
        return self.factor * self.stated.expanded


def rows_of(fit: Fit, found: FitUncertainty | None) -> list[FitRow]:
    rows = []
    spec = fit.shape.spec
    if not spec.centred:
        foot = None if found is None else found.foot
        rows.append(
            FitRow(say_word(spec.point_word), "point", _vector(fit.point), "mm", foot, "mm")
        )
    else:
        for k, axis in enumerate("xyz"):
            own = None if found is None or found.centre is None else found.centre[k]
            title, key = f"{say_word(spec.point_word)} {axis}", f"centre_{axis}"
            rows.append(FitRow(title, key, (float(fit.point[k]),), "mm", own, "mm"))
    if fit.direction.any():
        own, words = None if found is None else found.direction, spec.direction_word
        rows.append(FitRow(say_word(words), words.lower(), _vector(fit.direction), "", own, "rad"))
    if fit.across.any():
        own = None if found is None else found.turn
        rows.append(
            FitRow(say("Direction of its length"), "across", _vector(fit.across), "", own, "rad")
        )
    for size in spec.sizes:
        unit, factor = ("deg", float(np.degrees(2.0))) if size.is_angle else ("mm", 2.0)
        own = None if found is None else _stated(found, size.place)
        values = (factor * float(fit.geometry[size.place]),)
        key = size.word.replace(" ", "_")
        rows.append(FitRow(say_word(size.title), key, values, unit, own, unit, factor))
    tube = fit.free and fit.criterion is Criterion.MINIMUM_ZONE
    word = say("diameter of the tube about it") if tube else say("peak to valley")
    rows.append(FitRow(say(f"Form ({word})"), "form", (fit.form,), "mm", None, ""))
    rows.append(FitRow(say("RMS of the residuals"), "rms", (fit.rms,), "mm", None, ""))
    return rows


def _stated(found: FitUncertainty, place: int) -> Stated | None:
    return {RADIUS: found.radius, SECOND: found.second, HALF_ANGLE: found.half_angle}[place]


def _vector(vector: Float) -> tuple[float, ...]:
    return tuple(float(value) for value in vector)
