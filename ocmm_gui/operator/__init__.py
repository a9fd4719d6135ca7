"""Screens of the inspector: digits, tolerance, plan and guidance.

In: live snapshots and views of the job from the bridge. Out: two screens, and selected points.

Start with `_far_view` (legible at three metres) and `_desk_view` (everything), then their parts:
`_readout`, `_guidance`, `_far_message`, `_target_ring`, `_feature_panel` with `_feature_details`,
`_plan_list`, `_part_view`, `_status_strip`, `_trust_bar`, `_tip_line`, `_simulated_band`.
`_job_sheet` starts a job, `_point_choice` selects a point, `_feedback` plays sounds.
It must not import results, plan editor, Maintain or wizards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.operator._desk_view import DeskView
    from ocmm_gui.operator._far_view import FarView
    from ocmm_gui.operator._feedback import Feedback
    from ocmm_gui.operator._job_sheet import JobSheet
    from ocmm_gui.operator._point_choice import PointChoice
    from ocmm_gui.operator._simulated_band import SimulatedBand
    from ocmm_gui.operator._tip_line import TipLine
    from ocmm_gui.operator._trust_bar import TrustBar, TrustPlace
else:
    __getattr__ = door(
        __name__,
        _desk_view="DeskView",
        _feedback="Feedback",
        _far_view="FarView",
        _job_sheet="JobSheet",
        _point_choice="PointChoice",
        _simulated_band="SimulatedBand",
        _tip_line="TipLine",
        _trust_bar="TrustPlace TrustBar",
    )

__all__ = [
    "DeskView",
    "FarView",
    "Feedback",
    "JobSheet",
    "PointChoice",
    "SimulatedBand",
    "TipLine",
    "TrustBar",
    "TrustPlace",
]
