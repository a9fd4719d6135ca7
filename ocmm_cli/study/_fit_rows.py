"""Results of ``ocmm fit``: one list of numbers for the table and for JSON.

The format of ``ocmm fit --json`` is in docs/quality/fits.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_cli.terminal import tr, tr_word
from ocmm_core.features.measured import CommandingPoints, outliers
from ocmm_core.features.shapes import HALF_ANGLE, RADIUS, SECOND, Criterion, Fit
from ocmm_core.geometry import Points3
from ocmm_core.tables import TableAccount
from ocmm_core.tolerances.uncertainty import TWO_SIDED, FitUncertainty, Stated


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
        foot, point = None if found is None else found.foot, tuple(fit.point.tolist())
        rows.append(FitRow(tr_word(spec.point_word), "point", point, "mm", foot, "mm"))
    else:
        for k, axis in enumerate("xyz"):
            own = None if found is None or found.centre is None else found.centre[k]
            title, key = f"{tr_word(spec.point_word)} {axis}", f"centre_{axis}"
            rows.append(FitRow(title, key, (float(fit.point[k]),), "mm", own, "mm"))
    if fit.direction.any():
        own, words = None if found is None else found.direction, spec.direction_word
        toward, key = tuple(fit.direction.tolist()), words.lower()
        rows.append(FitRow(tr_word(words), key, toward, "", own, "rad"))
    if fit.across.any():
        own, title = None if found is None else found.turn, tr("Direction of its length")
        rows.append(FitRow(title, "across", tuple(fit.across.tolist()), "", own, "rad"))
    for size in spec.sizes:
        unit, factor = ("deg", float(np.degrees(2.0))) if size.is_angle else ("mm", 2.0)
        own = None
        if found is not None:
            stated = {RADIUS: found.radius, SECOND: found.second, HALF_ANGLE: found.half_angle}
            own = stated[size.place]
        values = (factor * float(fit.geometry[size.place]),)
        key = size.word.replace(" ", "_")
        rows.append(FitRow(tr_word(size.title), key, values, unit, own, unit, factor))
    tube = fit.free and fit.criterion is Criterion.MINIMUM_ZONE
    word = tr("diameter of the tube about it") if tube else tr("peak to valley")
    rows.append(FitRow(tr(f"Form ({word})"), "form", (fit.form,), "mm", None, ""))
    rows.append(FitRow(tr("RMS of the residuals"), "rms", (fit.rms,), "mm", None, ""))
    return rows


SCHEMA = "ocmm.fit/1"


class UncertaintyPart(msgspec.Struct, frozen=True, kw_only=True):
    """Uncertainty of one number, in ``unit``: u, U and coverage factor.

    ``U`` and ``k`` are null if first order is not valid or the fit has a rival.
    """

    unit: str
    u: float
    U: float | None
    k: float | None
    degrees_of_freedom: float
    first_order_valid: bool


class NumberPart(msgspec.Struct, frozen=True, kw_only=True):
    """One number, or a vector of three; ``uncertainty`` is null if unknown."""

    name: str
    value: tuple[float, ...]
    unit: str
    uncertainty: UncertaintyPart | None


class FitFile(msgspec.Struct, frozen=True, kw_only=True):
    """The document; lengths in mm regardless of ``file_unit``.

    ``numbers`` are those of the table. ``probability`` is that of U. ``rival`` has the numbers of
    another element that the points cannot distinguish from this one. Rows of points count from 1.
    """

    schema: str
    file: str
    file_unit: str
    account: dict[str, object]
    """Accepted and omitted contents of the file."""
    shape: str
    criterion: str
    criterion_letter: str
    free: bool
    points: int
    probability: float
    numbers: tuple[NumberPart, ...]
    rival: tuple[NumberPart, ...] | None
    outliers: tuple[int, ...]
    commanding: tuple[int, ...]
    """Rows without which the others agree far better."""
    contacts: tuple[int, ...]


def fit_json(
    file: Path,
    account: TableAccount,
    fit: Fit,
    points: Points3,
    criterion: str,
    found: FitUncertainty | None,
    odd: CommandingPoints | None,
) -> str:
    """Return the JSON text, numbers with all digits."""
    least_squares = fit.criterion is Criterion.LEAST_SQUARES
    whole = FitFile(
        schema=SCHEMA,
        file=str(file),
        file_unit=account.unit,
        account=account.as_json(),
        shape=fit.shape.value,
        criterion=criterion,
        criterion_letter=fit.criterion.value,
        free=fit.free,
        points=len(points),
        probability=TWO_SIDED,
        numbers=tuple(_number(row) for row in rows_of(fit, found)),
        rival=None
        if fit.rival is None
        else tuple(_number(row) for row in rows_of(fit.rival, None)),
        outliers=tuple(row + 1 for row in outliers(fit, points)) if least_squares else (),
        commanding=() if odd is None else odd.numbers,
        contacts=tuple(row + 1 for row in fit.contacts),
    )
    return msgspec.json.format(msgspec.json.encode(whole), indent=2).decode()


def _number(row: FitRow) -> NumberPart:
    stated = row.stated
    uncertainty = None
    if stated is not None:
        uncertainty = UncertaintyPart(
            unit=row.stated_unit,
            u=row.factor * stated.standard,
            U=row.expanded,
            k=stated.k,
            degrees_of_freedom=stated.degrees,
            first_order_valid=stated.valid,
        )
    return NumberPart(name=row.key, value=row.values, unit=row.unit, uncertainty=uncertainty)
