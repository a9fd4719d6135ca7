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
        involved_features,
        needs_part_frame,
        taken_again,
    )
    from ocmm_core.tolerances.kinds._form import form
    from ocmm_core.tolerances.kinds._measure import geometry_value
    from ocmm_core.tolerances.kinds._orientation import zone_of_axis
    from ocmm_core.tolerances.kinds._size import own_association
else:
    __getattr__ = door(
        __name__,
        _checks="characteristic_fault",
        _evaluate="evaluate involved_features needs_part_frame taken_again",
        _form="form",
        _measure="geometry_value",
        _orientation="zone_of_axis",
        _size="own_association",
    )

__all__ = [
    "characteristic_fault",
    "evaluate",
    "form",
    "geometry_value",
    "involved_features",
    "needs_part_frame",
    "own_association",
    "taken_again",
    "zone_of_axis",
]
