"""Causes of results that are not good, by the evidence in the job.

In: an evaluated job with a characteristic that is NOT CONFORM or NOT PROVEN.
Out: the amount, the supported cause, the points behind it, and the remedy.

Read `_inquiry` (possible causes, results under hypotheses), `_causes` (entry and choice),
`_deviations` (also points contradicted by others) and `_common_causes` (errors shared by a whole
job), `_remaining_causes`. A cause is tried before it is named. It must not know a session: it
changes nothing.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.causes._causes import EXPLAINED, explanations, explanations_of
    from ocmm_core.inspection.causes._inquiry import Cause, CauseFinding, Explanation, points_words
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "EXPLAINED", "Cause", "CauseFinding", "Explanation", "explanations", "explanations_of",
    "points_words",
]  # fmt: skip
