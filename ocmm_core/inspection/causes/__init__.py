"""Why a value is as it is: what the evidence of a job speaks for.

In: an evaluated job with a characteristic that is NOT CONFORM or NOT PROVEN.
Out: by how much, which cause the evidence speaks for, which points, and what to do now.

Read `_cause` (what may be behind it), `_explain` (the way in), `_inquiry` (what results would be
if points were others), `_amounts`, `_suspects` (points that others speak against), `_deviations`
and `_common_causes` (errors that a whole job shares), `_remaining_causes`, `_causes` (the choice).
A cause is tried before it is named. It must not know a session: it changes nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.causes._cause import Cause, CauseFinding, Explanation, points_words
    from ocmm_core.inspection.causes._explain import EXPLAINED, explanations, explanations_of
else:
    __getattr__ = door(
        __name__,
        _cause="Cause CauseFinding Explanation points_words",
        _explain="EXPLAINED explanations explanations_of",
    )

__all__ = [
    "EXPLAINED", "Cause", "CauseFinding", "Explanation", "explanations", "explanations_of",
    "points_words",
]  # fmt: skip
