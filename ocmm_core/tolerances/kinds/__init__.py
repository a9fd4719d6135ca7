"""Every kind of characteristic: its value, and how it answers to every point.

In: measured features, datums, the frame. Out: a value with its gradient by all ball centres.

Read `_checks` (what each kind names and needs) and `_evaluate` (which file computes what), then
`_measure` (sizes, distances, coordinates, angles from geometry), `_size`, `_angle`, and those with
a zone: `_form`, `_orientation`, `_location`, `_profile`, `_runout`, `_symmetry`.
It must not know uncertainty or limits: a value is the same whatever is allowed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tolerances.kinds._checks import characteristic_fault
    from ocmm_core.tolerances.kinds._evaluate import (
        evaluate,
        geometry_value,
        involved_features,
        needs_part_frame,
        taken_again,
    )
    from ocmm_core.tolerances.kinds._registry import KINDS, spec_for, spec_of, symbol_of
    from ocmm_core.tolerances.kinds._size import own_association
    from ocmm_core.tolerances.kinds._spec import KindSpec, MonteCarlo, QifWords, Symbol
else:
    __getattr__ = door(
        __name__,
        _checks="characteristic_fault",
        _evaluate="evaluate geometry_value involved_features needs_part_frame taken_again",
        _registry="KINDS spec_for spec_of symbol_of",
        _size="own_association",
        _spec="KindSpec MonteCarlo QifWords Symbol",
    )

__all__ = [
    "KINDS",
    "KindSpec",
    "MonteCarlo",
    "QifWords",
    "Symbol",
    "characteristic_fault",
    "evaluate",
    "geometry_value",
    "involved_features",
    "needs_part_frame",
    "own_association",
    "spec_for",
    "spec_of",
    "symbol_of",
    "taken_again",
]
