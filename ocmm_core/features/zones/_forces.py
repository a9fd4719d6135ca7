"""Curvature where more points touch than are needed, so that several sets of forces balance.

Then no single set has to hold a zone against every move: it is a smallest one where for each way
there is a set of forces whose curvature is against it (second-order conditions of minimax problems;
J. Bonnans and A. Shapiro, Perturbation Analysis of Optimization Problems, 2000, section 3.2).
Contacts of a cylinder that all lie in one section are such a case: the lean is held in each way by
other forces among them.
"""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np

from ocmm_core.geometry import Float

MOST_SETS = 5000
"""Combinations of contacts that are looked at; beyond, nothing is said."""
BALANCED = 1e-10
RANK = 1e-10


def least_held(hessians: Float, touch: Float, right: Float) -> float | None:
    """Return the least, over all ways, of the greatest curvature that a set of forces has there.

    Parameters
    ----------
    hessians
        (c, m, m): second derivatives of the distances of the contacts, with the sign of their side,
        in the directions that the contacts leave free.
    touch, right
        (r, c) and (r,): forces, none negative, balance where ``touch @ forces`` is ``right``.

    Returns
    -------
    Of ways of length one; None where there are more than two directions or too many contacts.
    """
    if not 1 <= hessians.shape[1] <= 2:
        return None
    sets = _extreme_forces(touch, right)
    if sets is None or not len(sets):
        return None
    forms = np.einsum("vc,cij->vij", sets, hessians)
    if hessians.shape[1] == 1:
        return float(forms.max())
    mean = 0.5 * (forms[:, 0, 0] + forms[:, 1, 1])
    cosine, sine = 0.5 * (forms[:, 0, 0] - forms[:, 1, 1]), forms[:, 0, 1]
    # The greatest of some waves is least where one of them is, or where two of them cross.
    turns = [np.arctan2(-sine, -cosine)]
    first, second = np.triu_indices(len(forms), 1)
    level, c, s = (wave[first] - wave[second] for wave in (mean, cosine, sine))
    height = np.hypot(c, s)
    cross = np.abs(level) < height
    apart = np.arccos(-level[cross] / height[cross])
    middle = np.arctan2(s[cross], c[cross])
    turns += [middle - apart, middle + apart]
    turn = np.concatenate(turns)[:, None]
    waves = mean + cosine * np.cos(turn) + sine * np.sin(turn)
    return float(waves.max(axis=1).min())


def _extreme_forces(touch: Float, right: Float) -> Float | None:
    """Return the sets of forces (v, c) of which all others are mixtures; None if too many."""
    count = touch.shape[1]
    u, strength, _ = np.linalg.svd(touch, full_matrices=False)
    kept = u[:, strength > RANK * strength[0]].T
    rank = len(kept)
    if comb(count, rank) > MOST_SETS:
        return None
    chosen = np.array(list(combinations(range(count), rank)))
    matrices = np.moveaxis((kept @ touch)[:, chosen], 1, 0)
    sound = np.abs(np.linalg.det(matrices)) > RANK * np.prod(strength[:rank])
    forces = np.linalg.solve(
        matrices[sound], np.broadcast_to(kept @ right, (sound.sum(), rank))[:, :, None]
    )[:, :, 0]
    pushing = forces.min(axis=1, initial=0.0) > -BALANCED
    sets = np.zeros((int(pushing.sum()), count))
    np.put_along_axis(sets, chosen[sound][pushing], np.maximum(forces[pushing], 0.0), axis=1)
    return sets
