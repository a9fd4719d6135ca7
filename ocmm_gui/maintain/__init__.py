"""Maintain mode: pages on the condition of the machine.

In: records and histories of rig and probe, the bus report, older jobs.
Out: pages, and irreversible actions, which require a second key press.

Start with `_maintain_view` (list of pages, and the actions), then the pages: `_calibration_page`,
`_probe_page`, `_bus_page`, `_probe_design_page`, `_rig_plan_page`, `_fits_page`, `_recall_sheet`.
`_status_page` is the base of calibration and probe pages, `_computed_page` of those that compute;
the others are tables and pictures of one page.
It must not import the inspector's screens, results, plan editor or wizards.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.maintain._bus_page import BusPage
    from ocmm_gui.maintain._calibration_page import CalibrationPage
    from ocmm_gui.maintain._fits_page import FitsPage
    from ocmm_gui.maintain._maintain_view import ConfirmedActions, MaintainView, Page
    from ocmm_gui.maintain._probe_design_page import ProbeDesignPage, plain_body
    from ocmm_gui.maintain._probe_page import ProbePage
    from ocmm_gui.maintain._recall_sheet import RecallSheet
    from ocmm_gui.maintain._rig_plan_page import RigPlanPage
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BusPage", "CalibrationPage", "ConfirmedActions", "FitsPage", "MaintainView", "Page",
    "ProbeDesignPage", "ProbePage", "RecallSheet", "RigPlanPage", "plain_body",
]  # fmt: skip
