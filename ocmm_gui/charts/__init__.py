"""Plots with axes: a common frame and its contents.

In: arrays and results of the core. Out: painted widgets in the colours of the theme.

Start with `_plot` (frame of all plots), then by subject: `_tolerance_bar` and `_trend_chart`
(results), `_residual_plots`, `_space_plot`, `_error_chart` and `_history_charts` (cameras),
`_interim_plot` (checks), `_study_plots` (gauge studies), `_pivot_plots`, `_sphere_map`,
`_trail_plot` and `_design_plots` (probe), `_bus_charts`, `_bars`.
It must not import sheets, wizards or the station: charts receive their data.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.charts._bars import Bars, Row
    from ocmm_gui.charts._bus_charts import Curve, HistogramChart, RecentChart
    from ocmm_gui.charts._design_plots import BendingPlot, MapPlot
    from ocmm_gui.charts._error_chart import ErrorChart, check_words, group_of, is_amount
    from ocmm_gui.charts._history_charts import HistoryChart
    from ocmm_gui.charts._interim_plot import InterimPlot
    from ocmm_gui.charts._pivot_plots import SpotResiduals, TipCourse
    from ocmm_gui.charts._plot import Plot
    from ocmm_gui.charts._residual_plots import AllSensors, ResidualHistogram
    from ocmm_gui.charts._space_plot import SpaceArrows
    from ocmm_gui.charts._sphere_map import Mapped, SphereMap
    from ocmm_gui.charts._study_plots import ComponentsPlot, OperatorsPlot, RunPlot
    from ocmm_gui.charts._tolerance_bar import ToleranceBar
    from ocmm_gui.charts._trail_plot import Trail, TrailPlot
    from ocmm_gui.charts._trend_chart import TrendChart
else:
    __getattr__ = door(
        __name__,
        _bars="Bars Row",
        _bus_charts="Curve HistogramChart RecentChart",
        _design_plots="BendingPlot MapPlot",
        _error_chart="ErrorChart check_words group_of is_amount",
        _history_charts="HistoryChart",
        _interim_plot="InterimPlot",
        _pivot_plots="SpotResiduals TipCourse",
        _plot="Plot",
        _residual_plots="AllSensors ResidualHistogram",
        _space_plot="SpaceArrows",
        _sphere_map="Mapped SphereMap",
        _study_plots="ComponentsPlot OperatorsPlot RunPlot",
        _tolerance_bar="ToleranceBar",
        _trail_plot="Trail TrailPlot",
        _trend_chart="TrendChart",
    )

__all__ = [
    "AllSensors", "Bars", "BendingPlot", "ComponentsPlot", "Curve", "ErrorChart", "HistogramChart",
    "HistoryChart", "InterimPlot", "MapPlot", "Mapped", "OperatorsPlot", "Plot", "RecentChart",
    "ResidualHistogram", "Row", "RunPlot", "SpaceArrows", "SphereMap", "SpotResiduals", "TipCourse",
    "ToleranceBar", "Trail", "TrailPlot", "TrendChart", "check_words", "group_of", "is_amount",
]  # fmt: skip
