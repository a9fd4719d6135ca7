"""Format of ``ocmm fit --json``; see docs/quality/fits.md."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ocmm_cli.study._fit_rows import FitRow, rows_of
from ocmm_core.features.measured import CommandingPoints, outliers
from ocmm_core.features.shapes import Criterion, Fit
from ocmm_core.geometry import Points3
from ocmm_core.tables import TableAccount
from ocmm_core.tolerances.uncertainty import TWO_SIDED, FitUncertainty

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
