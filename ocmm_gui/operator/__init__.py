"""Screens of the inspector: digits, tolerance, plan and guidance.

In: live snapshots and views of the job from the bridge. Out: two screens, and selected points.

Start with `_far_view` (legible at three metres) and `_desk_view` (everything, and the choice of a
point), then their parts: `_readout` (also sounds), `_status_strip` (also of the server for
measuring programs), `_status_bands`, `_view_parts` (also the plan list), `_feature_panel` with
`_feature_details`. `_job_sheet` starts a job. It must not import results, plan editor, Maintain or
wizards.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.operator._desk_view import DeskView, PointChoice
    from ocmm_gui.operator._far_view import FarView
    from ocmm_gui.operator._job_sheet import JobSheet
    from ocmm_gui.operator._readout import Feedback
    from ocmm_gui.operator._status_bands import SimulatedBand, TipLine, TrustBar, TrustPlace
    from ocmm_gui.operator._status_strip import ServiceStrip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "DeskView", "FarView", "Feedback", "JobSheet", "PointChoice", "ServiceStrip", "SimulatedBand",
    "TipLine", "TrustBar", "TrustPlace",
]  # fmt: skip
