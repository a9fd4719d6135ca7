"""Pages of the wizards, by kind of step, and their building blocks.

In: the snapshot of a step. Out: its display, and the user's input.

Start with `_shown` (common types, fields, texts) and `_pages` (preparing and
collecting pages) with `_live_panel`, `_picture`, `_result_frame`.
By subject: `_relocation_pages`, `_result_pages` (cameras, probe), `_sweep_page`, `_touch_pages`,
`_tip_result_page` (tip, verification), `_definition_page` with `_definition_form`
(definition of a probe). Pages get their data by constructor, and must not import the wizard.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.wizards.pages._definition_page import DefinitionPage
    from ocmm_gui.wizards.pages._pages import (
        CollectPage, KnownPointsPage, LinesPage, PreparePage, ProbePreparePage, SeatsPage, StepPage,
        StepPlan, TrackerPage, planned_lines, planned_points,
    )  # fmt: skip
    from ocmm_gui.wizards.pages._picture import BarPlace, Contents, bars
    from ocmm_gui.wizards.pages._relocation_pages import BarPage, WavePage, WorldPage
    from ocmm_gui.wizards.pages._result_frame import Filled, PlotTabs, ResultFrame, ResultVerdict
    from ocmm_gui.wizards.pages._result_pages import PivotResultPage, ResultPage, TrackerResultPage
    from ocmm_gui.wizards.pages._shown import (
        CALIBRATION_ENDS, TEMPERATURE, THERMOMETER, VERDICT_ENDS, WHO, Field, StepSnapshot, Tap,
        TemperatureReadings, WizardTexts, gate_words, is_unstored, practice_title,
    )  # fmt: skip
    from ocmm_gui.wizards.pages._sweep_page import FirstConePage, SpheresPage, SweepPage
    from ocmm_gui.wizards.pages._tip_result_page import (
        TipCheckResultPage, TipResultPage, VerdictPage, repeat_worst,
    )  # fmt: skip
    from ocmm_gui.wizards.pages._touch_pages import ConePage, SpherePage
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CALIBRATION_ENDS", "TEMPERATURE", "THERMOMETER", "VERDICT_ENDS", "WHO", "BarPage", "BarPlace",
    "CollectPage", "ConePage", "Contents", "DefinitionPage", "Field", "Filled", "FirstConePage",
    "KnownPointsPage", "LinesPage", "PivotResultPage", "PlotTabs", "PreparePage",
    "ProbePreparePage", "ResultFrame", "ResultPage", "ResultVerdict", "SeatsPage", "SpherePage",
    "SpheresPage", "StepPage", "StepPlan", "StepSnapshot", "SweepPage", "Tap",
    "TemperatureReadings", "TipCheckResultPage", "TipResultPage", "TrackerPage",
    "TrackerResultPage", "VerdictPage", "WavePage", "WizardTexts", "WorldPage", "bars",
    "gate_words", "is_unstored", "planned_lines", "planned_points", "practice_title",
    "repeat_worst",
]  # fmt: skip
