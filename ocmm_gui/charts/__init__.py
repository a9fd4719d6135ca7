"""Plots with axes: a common frame and its contents.

In: arrays and results of the core. Out: painted widgets in the colours of the theme.

Start with `_plot` (frame of all plots), then by subject: `_tolerance_bar` (results, trends),
`_residual_plots` (cameras), `_check_charts` (checks against limits), `_study_plots` (gauge
studies), `_pivot_plots`, `_tip_plots` and `_design_plots` (probe), `_bus_charts` (bus, history).
It must not import sheets, wizards or the station: charts receive their data.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.charts._bus_charts import Curve, HistogramChart, HistoryChart, RecentChart
    from ocmm_gui.charts._check_charts import (
        ErrorChart, InterimPlot, check_words, group_of, is_amount, session_of,
    )  # fmt: skip
    from ocmm_gui.charts._design_plots import BendingPlot, MapPlot
    from ocmm_gui.charts._pivot_plots import SpotResiduals, TipCourse, Trail, TrailPlot
    from ocmm_gui.charts._plot import Plot
    from ocmm_gui.charts._residual_plots import AllSensors, ResidualHistogram, SpaceArrows
    from ocmm_gui.charts._study_plots import ComponentsPlot, OperatorsPlot, RunPlot
    from ocmm_gui.charts._tip_plots import Bars, Mapped, Row, SphereMap
    from ocmm_gui.charts._tolerance_bar import ToleranceBar, TrendChart
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AllSensors", "Bars", "BendingPlot", "ComponentsPlot", "Curve", "ErrorChart", "HistogramChart",
    "HistoryChart", "InterimPlot", "MapPlot", "Mapped", "OperatorsPlot", "Plot", "RecentChart",
    "ResidualHistogram", "Row", "RunPlot", "SpaceArrows", "SphereMap", "SpotResiduals", "TipCourse",
    "ToleranceBar", "Trail", "TrailPlot", "TrendChart", "check_words", "group_of", "is_amount",
    "session_of",
]  # fmt: skip
