"""Wizards: guided calibration, relocation and verification, as pages over core procedures.

In: a guided procedure of the core and its snapshots. Out: commands to it, and pages of each step.

Read `_registry` (one entry a wizard says everything), `_wizard` (begin or resume, then run),
`_wizard` with `_camera_sessions` and `_probe_sessions` (what is asked, how a session begins),
`_site` (rig, probe, records, frames), `_driver` (commands out, snapshots in, nothing waits),
`_runner` (rail, page, why Next is closed), `_guided_stack` (one at a time, behind its first page).
`parts` is what pages are made of, `pages` the pages themselves.
Steps, gates and numbers are in `ocmm_core.calibration`. It must not know the inspector's screens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards._driver import WizardDriver
    from ocmm_gui.wizards._guided_stack import GuidedStack
    from ocmm_gui.wizards._registry import WIZARDS, WizardSpec
    from ocmm_gui.wizards._runner import Runner
    from ocmm_gui.wizards._site import (
        SESSIONS,
        DirectCalculation,
        ProbeSite,
        Subject,
        WizardSite,
        practice_site,
        site_of,
        temperature,
    )
    from ocmm_gui.wizards._wizard import Wizard
else:
    __getattr__ = door(
        __name__,
        _driver="WizardDriver",
        _guided_stack="GuidedStack",
        _registry="WIZARDS WizardSpec",
        _runner="Runner",
        _site=(
            "DirectCalculation ProbeSite SESSIONS Subject WizardSite practice_site site_of "
            "temperature"
        ),
        _wizard="Wizard",
    )

__all__ = [
    "SESSIONS",
    "WIZARDS",
    "DirectCalculation",
    "GuidedStack",
    "ProbeSite",
    "Runner",
    "Subject",
    "Wizard",
    "WizardDriver",
    "WizardSite",
    "WizardSpec",
    "practice_site",
    "site_of",
    "temperature",
]
