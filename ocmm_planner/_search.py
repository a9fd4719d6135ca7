"""Search of the placement with the smallest worst U."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_planner._plan import RigPlan
from ocmm_planner._prediction import RigMap, predict_map, scene_of

_POPULATION = 10
"""Placements of a generation, for each coordinate that is sought."""
_UNSEEN = 1e3
"""Cost, mm, of a placement that leaves nodes without a number: seen nodes never outweigh it."""


def search_places(
    plan: RigPlan, *, seed: int, evaluations: int, step: Callable[[float], None]
) -> tuple[Float, int]:
    """Return the places (C, 6), mm, with the smallest worst U found, and the number of trials.

    U is that of the tip at the search nodes. Differential evolution (Storn and Price 1997) over the
    coordinates that may change; the given placement is one of the first generation.
    """
    given = plan.places
    least, most = given.copy(), given.copy()
    for row, one in enumerate(plan.document.cameras):
        if one.place is not None:
            least[row, :3], most[row, :3] = one.place.min, one.place.max
        if one.place is not None and one.place.aim == "free":
            least[row, 3:], most[row, 3:] = plan.volume
    free = most > least
    if not free.any():
        return given, 0
    nodes, tried = plan.nodes(plan.document.search_nodes), 0
    given = np.clip(given, least, most)

    def placed(values: Float) -> Float:
        moved = given.copy()
        moved[free] = values
        return moved

    def cost(values: Float) -> float:
        nonlocal tried
        tried += 1
        step(min(1.0, tried / evaluations))
        return placement_cost(plan, placed(values), nodes)

    # A Sobol sequence has a power of two.
    size = 1 << (max(5, _POPULATION * int(free.sum())) - 1).bit_length()
    found = differential_evolution(
        cost, Bounds(least[free], most[free]), x0=given[free], rng=np.random.default_rng(seed),
        polish=False, tol=1e-3, popsize=_POPULATION, init="sobol",
        maxiter=max(1, evaluations // size - 1),
    )  # fmt: skip
    return placed(found.x), tried


def placement_cost(plan: RigPlan, places: Float, nodes: Float) -> float:
    """Return the worst U of the tip at nodes (n, 3), mm; far more if a node has none."""
    if plan.inside_box(places[:, :3]).any():
        return 10.0 * _UNSEEN
    try:
        return cost_of(predict_map(scene_of(plan, places), nodes, with_length=False))
    except InputError:
        # The calibration points are outside its picture.
        return 5.0 * _UNSEEN


def cost_of(found: RigMap) -> float:
    """Return the worst U, mm; without one at some nodes, a cost that falls with their number."""
    if np.isfinite(found.u_tip).all():
        return float(found.u_tip.max())
    # The share of attitudes also guides a placement that sees no node completely.
    seen = 0.5 * found.share + 0.5 * np.isfinite(found.u_tip)
    return _UNSEEN * float(2.0 - seen.mean())
