"""Fit of one element of any shape, by any criterion; all fits are cold started."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.features.elements import ELEMENTS, Known
from ocmm_core.features.search import with_rival
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.features.zones import Certificate, certificate, fit_bounded, fit_zone
from ocmm_core.geometry import Float, Points3

__all__ = ["Certificate", "associate", "certificate", "fit_shape"]


def fit_shape(
    shape: Shape,
    points: Points3,
    *,
    direction_hint: Float | None = None,
    radius_hint: float | None = None,
    second_hint: float | None = None,
    half_angle_hint: float | None = None,
    criterion: Criterion = Criterion.LEAST_SQUARES,
    free: bool = False,
    offset: float = 0.0,
) -> Fit:
    """Return ``shape`` associated with ``points``.

    Parameters
    ----------
    points
        (n, 3), mm, in any order and place.
    direction_hint
        (3,): the result points along it; default: largest component positive. No effect on the
        position of the element. A cone has a direction of its own.
    radius_hint, second_hint, half_angle_hint
        mm, mm, rad: may decide between rivals (`Fit.rival`); else not used.
    criterion
        Association criterion; all others start from least squares.
    free
        Circle only: in space as one problem, not plane first.
    offset
        mm, shapes whose ball is ``kept``: distance of the points outside of the element.

    Returns
    -------
    The best element, with another one in `Fit.rival` if the points do not exclude it. `unambiguous`
    refuses such a fit.

    Raises
    ------
    FitError
        The points do not determine the shape, or it does not support the criterion.
    """
    if criterion is not Criterion.LEAST_SQUARES:
        start = fit_shape(
            shape, points, direction_hint=direction_hint, radius_hint=radius_hint,
            second_hint=second_hint, half_angle_hint=half_angle_hint, free=free, offset=offset,
        )  # fmt: skip
        return associate(start, points, criterion, offset)
    known = Known(direction_hint, radius_hint, second_hint, half_angle_hint, free, offset)
    return ELEMENTS[shape].fit(points, known)


def associate(start: Fit, points: Points3, criterion: Criterion, offset: float = 0.0) -> Fit:
    """Return the element of another criterion from a least-squares fit; FitError as `fit_zone`."""
    if start.rival is not None:
        first = associate(replace(start, rival=None), points, criterion, offset)
        return with_rival(first, associate(start.rival, points, criterion, offset))
    if criterion is Criterion.MINIMUM_ZONE:
        return fit_zone(start, points, offset)
    return fit_bounded(start, points, criterion)
