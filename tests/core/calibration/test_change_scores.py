"""Scores of many changes at once against the formula for one."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.bundle._culprit_history import _scores


def test_scores_at_once_are_those_of_each_by_itself() -> None:
    rng = np.random.default_rng()
    made = rng.normal(size=(40, 5, 9))
    inner = made @ made.swapaxes(1, 2)
    # The fourth number of the second half is not seen at all.
    inner[20:, 3] = inner[20:, :, 3] = 0.0
    pulls, alone = rng.normal(size=(40, 5)), inner.diagonal(axis1=1, axis2=2) + 1.0
    for n, one in enumerate(_scores(inner, pulls, alone)):
        seen = np.arange(5) != 3 if n >= 20 else np.ones(5, dtype=bool)
        exact = np.zeros(5)
        exact[seen] = np.linalg.solve(inner[n][np.ix_(seen, seen)], pulls[n][seen])
        assert one.dof == np.count_nonzero(seen)
        # A product of 5 by 9 normal numbers has a condition of 1e3 or so, rarely of 1e5.
        np.testing.assert_allclose(one.size, exact, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(one.score, pulls[n] @ exact, rtol=1e-6)
        np.testing.assert_array_equal(one.information, inner[n])
