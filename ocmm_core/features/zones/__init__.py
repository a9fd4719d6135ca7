"""Minimum zones and bounding elements, each with a proof of optimality.

In: points and the least-squares fit to start from.
Out: the minimum zone or the bounding element, with contact points and balanced forces.

Read `_zone` (entry points), `_elements` (from a fit to a zone element), `_solver` with
`_settle_kernel` and `_kernel` (a dual simplex step), `_surfaces`,
`_distance_kernel` (distances, poses, steps), `_levels`, then `_certificate`, `_settled` and
`_rescue` (proof, and fallbacks). An unproven zone is refused. The package is independent of
tolerances and datums.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.zones._certificate import ZoneProof, certificate
    from ocmm_core.features.zones._elements import ZONES, task_of
    from ocmm_core.features.zones._solver import best_zone
    from ocmm_core.features.zones._surfaces import distances
    from ocmm_core.features.zones._zone import fit_bounded, fit_zone, fit_zone_line_in_plane
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ZONES", "ZoneProof", "best_zone", "certificate", "distances", "fit_bounded", "fit_zone",
    "fit_zone_line_in_plane", "task_of",
]  # fmt: skip
