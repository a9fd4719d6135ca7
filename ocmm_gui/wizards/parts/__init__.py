"""Building blocks of wizard pages.

In: snapshots of a procedure. Out: panels, forms, pictures and gates used by several pages.

Start with `_shown` (common types, fields and texts), `_pages` and `_hands_pages` (collecting
pages); then `_live_panel`, `_picture`, `_result_frame`, `_calculation` (in a separate process).
It must not import pages of single wizards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards.parts._calculation import ProcessCalculation
    from ocmm_gui.wizards.parts._hands_pages import (
        HandsPage,
        PreparePage,
        ProbePreparePage,
        StepPlan,
        planned_lines,
        planned_points,
    )
    from ocmm_gui.wizards.parts._live_panel import BannerMessage, Score
    from ocmm_gui.wizards.parts._pages import (
        CollectPage,
        KnownPointsPage,
        LinesPage,
        SeatsPage,
        StepPage,
    )
    from ocmm_gui.wizards.parts._picture import (
        BarPlace,
        Contents,
        ProbeDrawing,
        bars,
        volume_coverage,
    )
    from ocmm_gui.wizards.parts._result_frame import PlotTabs, ResultFrame, ResultVerdict
    from ocmm_gui.wizards.parts._shown import (
        CALIBRATION_ENDS,
        TEMPERATURE,
        THERMOMETER,
        VERDICT_ENDS,
        WHO,
        Calculation,
        Facts,
        Field,
        StepProcedure,
        StepSnapshot,
        Tap,
        TemperatureReadings,
        WizardTexts,
        figures_area,
        gate_words,
        is_unstored,
        practice_title,
    )
else:
    __getattr__ = door(
        __name__,
        _calculation="ProcessCalculation",
        _hands_pages="HandsPage PreparePage ProbePreparePage StepPlan planned_lines planned_points",
        _live_panel="BannerMessage Score",
        _pages="CollectPage KnownPointsPage LinesPage SeatsPage StepPage",
        _picture="BarPlace Contents ProbeDrawing bars volume_coverage",
        _result_frame="PlotTabs ResultFrame ResultVerdict",
        _shown=(
            "CALIBRATION_ENDS TEMPERATURE THERMOMETER VERDICT_ENDS WHO Calculation Facts Field "
            "StepProcedure StepSnapshot Tap TemperatureReadings WizardTexts figures_area "
            "gate_words is_unstored practice_title"
        ),
    )

__all__ = [
    "CALIBRATION_ENDS", "TEMPERATURE", "THERMOMETER", "VERDICT_ENDS", "WHO", "BannerMessage",
    "BarPlace", "Calculation", "CollectPage", "Contents", "Facts", "Field", "HandsPage",
    "KnownPointsPage", "LinesPage", "PlotTabs", "PreparePage", "ProbeDrawing", "ProbePreparePage",
    "ProcessCalculation", "ResultFrame", "ResultVerdict", "Score", "SeatsPage", "StepPage",
    "StepPlan", "StepProcedure", "StepSnapshot", "Tap", "TemperatureReadings", "WizardTexts",
    "bars", "figures_area", "gate_words", "is_unstored", "planned_lines", "planned_points",
    "practice_title", "volume_coverage",
]  # fmt: skip
