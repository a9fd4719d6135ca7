"""Least-squares fits by orthogonal distance, one module a shape, with a registry.

In: points (n, 3), mm.
Out: a `Fit`: geometry vector, residuals, Jacobian by all points.

Read `_plane` (point, line, plane and sphere) with `_ball`, then `_cylinder`, `_cone` and `_torus`
(cold start without an axis), `_flat` (also circles) with `_ellipse` and `_slot`. `_oriented` fits
with a given direction; `_distances` has derivatives of residuals;
`_registry` lists all. The package is independent of nominals and tolerances, so that the plan
cannot influence a fit.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.elements._ball import LARGEST_RADIUS
    from ocmm_core.features.elements._cone import fit_cone
    from ocmm_core.features.elements._cylinder import fit_cylinder
    from ocmm_core.features.elements._ellipse import fit_ellipse, fit_ellipse_projected
    from ocmm_core.features.elements._flat import fit_circle, fit_circle_free, fit_circle_projected
    from ocmm_core.features.elements._oriented import (
        fit_oriented, fixed_direction, turned_direction,
    )  # fmt: skip
    from ocmm_core.features.elements._plane import fit_line, fit_plane, fit_point, fit_sphere
    from ocmm_core.features.elements._registry import (
        ELEMENTS, ElementSpec, FitPrior, distance_derivatives, nominal_distances, surface_normals,
    )  # fmt: skip
    from ocmm_core.features.elements._slot import fit_slot, fit_slot_projected
    from ocmm_core.features.elements._torus import fit_torus
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ELEMENTS", "LARGEST_RADIUS", "ElementSpec", "FitPrior", "distance_derivatives", "fit_circle",
    "fit_circle_free", "fit_circle_projected", "fit_cone", "fit_cylinder", "fit_ellipse",
    "fit_ellipse_projected", "fit_line", "fit_oriented", "fit_plane", "fit_point", "fit_slot",
    "fit_slot_projected", "fit_sphere", "fit_torus", "fixed_direction", "nominal_distances",
    "surface_normals", "turned_direction",
]  # fmt: skip
