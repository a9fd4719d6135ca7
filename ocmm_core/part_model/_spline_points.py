"""Points and tangents of a spline surface."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from ocmm_core.geometry import Float
from ocmm_core.part_model._part_model import SplineSurface


def spline_points(spline: SplineSurface, uv: Float) -> Float:
    """Return points (n, 3), mm, of a surface at parameters ``uv`` (n, 2).

    Parameters beyond the ends of the knots are taken as those ends. Source: Piegl and Tiller, The
    NURBS Book, 4.4 (a rational surface is a polynomial one of four coordinates, divided).
    """
    top = _homogeneous(spline, uv, 0, 0)
    points: Float = top[:, :3] / top[:, 3:]
    return points


def spline_frames(spline: SplineSurface, uv: Float) -> tuple[Float, Float, Float]:
    """Return points and derivatives by u and by v, each (n, 3), at ``uv`` (n, 2).

    Source: as `spline_points`, by the rule of quotients: S' = (A' - w' S) / w.
    """
    top = _homogeneous(spline, uv, 0, 0)
    points = top[:, :3] / top[:, 3:]
    both = []
    for order in ((1, 0), (0, 1)):
        slope = _homogeneous(spline, uv, *order)
        both.append((slope[:, :3] - slope[:, 3:] * points) / top[:, 3:])
    return points, both[0], both[1]


def _homogeneous(spline: SplineSurface, uv: Float, order_u: int, order_v: int) -> Float:
    """Return (n, 4): weighted coordinates and weight, or their derivatives."""
    weights = spline.weights[..., None]
    poles = np.concatenate([spline.poles * weights, weights], axis=2)
    by_u = _basis(spline.knots_u, spline.degree_u, uv[:, 0], order_u)
    by_v = _basis(spline.knots_v, spline.degree_v, uv[:, 1], order_v)
    rows: Float = np.einsum("nv,nvk->nk", by_v, np.tensordot(by_u, poles, axes=(1, 0)))
    return rows


def _basis(knots: Float, degree: int, at: Float, order: int) -> Float:
    """Return (n, poles): the value of each basis function, or its derivative."""
    at = np.clip(at, knots[degree], knots[-degree - 1])
    if order == 0:
        return np.asarray(BSpline.design_matrix(at, knots, degree).toarray())
    lower = BSpline.design_matrix(at, knots[1:-1], degree - 1).toarray() if degree > 1 else (
        _steps(knots[1:-1], at)
    )  # fmt: skip
    spans = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    share = degree * np.divide(1.0, spans, out=np.zeros_like(spans), where=spans > 0.0)
    slopes = np.zeros((len(at), len(knots) - degree - 1))
    slopes[:, 1:] += lower * share
    slopes[:, :-1] -= lower * share
    return slopes


def _steps(knots: Float, at: Float) -> Float:
    """Return basis functions of degree 0: 1 in the span that ``at`` lies in."""
    last = int(np.searchsorted(knots, knots[-1]))
    span = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, last - 1)
    ones = np.zeros((len(at), len(knots) - 1))
    ones[np.arange(len(at)), span] = 1.0
    return ones
