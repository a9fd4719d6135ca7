"""Building blocks of wizard pages.

In: snapshots of a procedure. Out: panels, forms, pictures and gates used by several pages.

Start with `_shown` (common types), `_pages` and `_hands_pages` (collecting pages); then
`_live_panel`, `_far_banner`, `_picture` and `_probe_picture`, `_forms`, `_facts`,
`_result_frame`, `_calculation` (in a separate process), `_messages` (texts).
It must not import pages of single wizards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards.parts._calculation import ProcessCalculation
    from ocmm_gui.wizards.parts._facts import Facts, figures_area
    from ocmm_gui.wizards.parts._far_banner import Told
    from ocmm_gui.wizards.parts._forms import TEMPERATURE, THERMOMETER, WHO, Field
    from ocmm_gui.wizards.parts._hands_pages import HandsPage, ProbePreparePage
    from ocmm_gui.wizards.parts._live_panel import Score
    from ocmm_gui.wizards.parts._messages import (
        CALIBRATION_ENDS,
        VERDICT_ENDS,
        WizardTexts,
        gate_words,
        is_unstored,
        practice_title,
    )
    from ocmm_gui.wizards.parts._pages import (
        CollectPage,
        KnownPointsPage,
        LinesPage,
        SeatsPage,
        StepPage,
    )
    from ocmm_gui.wizards.parts._picture import BarPlace, Contents, bars, volume_coverage
    from ocmm_gui.wizards.parts._prepare_page import (
        Planned,
        PreparePage,
        planned_lines,
        planned_points,
    )
    from ocmm_gui.wizards.parts._probe_picture import ProbePicture
    from ocmm_gui.wizards.parts._result_frame import PlotTabs, ResultFrame, Said
    from ocmm_gui.wizards.parts._shown import (
        Calculation,
        Seen,
        ShownProcedure,
        Tap,
        TemperatureReadings,
    )
else:
    __getattr__ = door(
        __name__,
        _calculation="ProcessCalculation",
        _facts="Facts figures_area",
        _far_banner="Told",
        _forms="Field TEMPERATURE THERMOMETER WHO",
        _hands_pages="HandsPage ProbePreparePage",
        _live_panel="Score",
        _pages="CollectPage KnownPointsPage LinesPage SeatsPage StepPage",
        _picture="BarPlace Contents bars volume_coverage",
        _prepare_page="Planned PreparePage planned_lines planned_points",
        _probe_picture="ProbePicture",
        _result_frame="PlotTabs ResultFrame Said",
        _shown="Calculation Seen ShownProcedure Tap TemperatureReadings",
        _messages=(
            "CALIBRATION_ENDS VERDICT_ENDS WizardTexts gate_words is_unstored practice_title"
        ),
    )

__all__ = [
    "CALIBRATION_ENDS", "TEMPERATURE", "THERMOMETER", "VERDICT_ENDS", "WHO", "BarPlace",
    "Calculation", "CollectPage", "Contents", "Facts", "Field", "HandsPage", "KnownPointsPage",
    "LinesPage", "Planned", "PlotTabs", "PreparePage", "ProbePicture", "ProbePreparePage",
    "ProcessCalculation", "ResultFrame", "Said", "Score", "SeatsPage", "Seen", "ShownProcedure",
    "StepPage", "Tap", "TemperatureReadings", "Told", "WizardTexts", "bars", "figures_area",
    "gate_words", "is_unstored", "planned_lines", "planned_points", "practice_title",
    "volume_coverage",
]  # fmt: skip
