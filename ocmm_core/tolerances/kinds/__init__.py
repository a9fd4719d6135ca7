"""All kinds of characteristics: value, and its gradient by every point.

In: measured features, datums, the frame.
Out: a value with its gradient by all ball centres.

Read `_spec` (form of an entry) and `_registry` (all entries, and checks that they drive), then
`_evaluate` (also for a part as drawn). The kinds, each file with its entries at the end: `_size`,
`_distance`, `_angle`, and those with a zone: `_form`, `_location`, `_related` (orientation,
profile, run-out). Code outside does not compare kind names; `spec_of` refuses unknown ones. The
package is independent of uncertainty.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tolerances.kinds._evaluate import (
        drawn_value, evaluate, geometry_value, involved_features, needs_part_frame, taken_again,
    )  # fmt: skip
    from ocmm_core.tolerances.kinds._registry import (
        KINDS, characteristic_fault, spec_for, spec_of, symbol_of,
    )  # fmt: skip
    from ocmm_core.tolerances.kinds._size import own_association
    from ocmm_core.tolerances.kinds._spec import KindSpec, MonteCarlo, Symbol
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "KINDS", "KindSpec", "MonteCarlo", "Symbol", "characteristic_fault", "drawn_value", "evaluate",
    "geometry_value", "involved_features", "needs_part_frame", "own_association", "spec_for",
    "spec_of", "symbol_of", "taken_again",
]  # fmt: skip
