"""Why a value is as it is: what the evidence of a job speaks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.causes._cause import Cause, Explanation, points_words
    from ocmm_core.inspection.causes._explain import EXPLAINED, explanations, explanations_of
else:
    __getattr__ = door(
        __name__,
        _cause="Cause Explanation points_words",
        _explain="EXPLAINED explanations explanations_of",
    )

__all__ = [
    "EXPLAINED",
    "Cause",
    "Explanation",
    "explanations",
    "explanations_of",
    "points_words",
]
