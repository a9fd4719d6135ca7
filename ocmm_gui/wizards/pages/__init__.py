"""Pages of the wizards, by kind of step.

In: the snapshot of a step. Out: its display, and the user's input.

By subject: `_relocation_pages`, `_result_pages` (cameras, probe), `_verdict_page` (verification),
`_sweep_page`, `_touch_pages`, `_tip_result_page` (tip), `_definition_page` with `_definition_form`
(definition of a probe). Pages get their data by constructor. They must not import the wizard that
shows them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards.pages._definition_page import DefinitionPage
    from ocmm_gui.wizards.pages._relocation_pages import BarPage, WavePage, WorldPage
    from ocmm_gui.wizards.pages._result_pages import PivotResultPage, ResultPage
    from ocmm_gui.wizards.pages._sweep_page import FirstConePage, SpheresPage, SweepPage
    from ocmm_gui.wizards.pages._tip_result_page import TipCheckResultPage, TipResultPage
    from ocmm_gui.wizards.pages._touch_pages import ConePage, SpherePage
    from ocmm_gui.wizards.pages._verdict_page import VerdictPage, repeat_worst
else:
    __getattr__ = door(
        __name__,
        _definition_page="DefinitionPage",
        _relocation_pages="BarPage WavePage WorldPage",
        _result_pages="PivotResultPage ResultPage",
        _sweep_page="FirstConePage SpheresPage SweepPage",
        _tip_result_page="TipCheckResultPage TipResultPage",
        _touch_pages="ConePage SpherePage",
        _verdict_page="VerdictPage repeat_worst",
    )

__all__ = [
    "BarPage", "ConePage", "DefinitionPage", "FirstConePage", "PivotResultPage", "ResultPage",
    "SpherePage", "SpheresPage", "SweepPage", "TipCheckResultPage", "TipResultPage", "VerdictPage",
    "WavePage", "WorldPage", "repeat_worst",
]  # fmt: skip
