"""Common part of the fits: starts, guarded Newton steps, rivals, compiled loops.

In: points, centred and scaled, and a kind of distance.
Out: the best minimum, and its rivals.

Read `_common` (checked points, centring, starts), `_solver` and `_newton_kernel` (guarded steps,
rivals that the points cannot exclude), `_search` (many starts, the best minimum, equal ends).
`_lanes_kernel` runs many starts in parallel, `_starts_kernel` finds them about trial axes. The
distances are in `_axis_kernel`, `_flat_kernel`, `_ellipse_kernel` and
`_point_kernel`. The package is independent of specific fits, which are in `elements`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.search import _axis_kernel as axis_kernel
    from ocmm_core.features.search import _ellipse_kernel as ellipse_kernel
    from ocmm_core.features.search import _flat_kernel as flat_kernel
    from ocmm_core.features.search import _newton_kernel as newton_kernel
    from ocmm_core.features.search._axis_kernel import CONE, CYLINDER, RING, TORUS, across
    from ocmm_core.features.search._common import (
        FLAT, across_axes, centred, centred_solid, checked_points, curved_patch, degenerate,
        few_axes, many_axes, oriented, principal_axes, quadric_axes, refuse_masked, trial_axes,
    )  # fmt: skip
    from ocmm_core.features.search._ellipse_kernel import conics, ellipse_foot, of_conic
    from ocmm_core.features.search._flat_kernel import BALL, DISC, ELLIPSE, ROUND_ENDS, SQUARE_ENDS
    from ocmm_core.features.search._newton_kernel import STEP_SIZE, move, solve_step, terms
    from ocmm_core.features.search._point_kernel import (
        line_distances, places, spread, spread_alike, taubin,
    )  # fmt: skip
    from ocmm_core.features.search._search import (
        Family, best_ends, is_open, minima, nearest_minimum, planned, sampled,
    )  # fmt: skip
    from ocmm_core.features.search._solver import (
        COVERAGE, NEAR, Solution, candidates, covered, decided, derivatives, gains, minimise, same,
        sensitivity, sizes_in_words, unambiguous, undecided, with_rival,
    )  # fmt: skip
    from ocmm_core.features.search._starts_kernel import (
        STRAIGHT, circles, flanks, narrowest_tube, quadric_feet, tubes,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BALL", "CONE", "COVERAGE", "CYLINDER", "DISC", "ELLIPSE", "FLAT", "NEAR", "RING", "ROUND_ENDS",
    "SQUARE_ENDS", "STEP_SIZE", "STRAIGHT", "TORUS", "Family", "Solution", "across", "across_axes",
    "axis_kernel", "best_ends", "candidates", "centred", "centred_solid", "checked_points",
    "circles", "conics", "covered", "curved_patch", "decided", "degenerate", "derivatives",
    "ellipse_foot", "ellipse_kernel", "few_axes", "flanks", "flat_kernel", "gains", "is_open",
    "line_distances", "many_axes", "minima", "minimise", "move", "narrowest_tube",
    "nearest_minimum", "newton_kernel", "of_conic", "oriented", "places", "planned",
    "principal_axes", "quadric_axes", "quadric_feet", "refuse_masked", "same", "sampled",
    "sensitivity", "sizes_in_words", "solve_step", "spread", "spread_alike", "taubin", "terms",
    "trial_axes", "tubes", "unambiguous", "undecided", "with_rival",
]  # fmt: skip
