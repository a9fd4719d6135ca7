"""Wizards: guided calibration, relocation and verification over core procedures.

In: a guided procedure of the core and its snapshots. Out: commands to it, and pages of each step.

Start with `_registry` (one entry per wizard) and `_wizard` (start or resume, then run); then
`_sessions` (fields, start and resume), `_site` (rig, probe, records, frames), `_driver` (commands
and snapshots without blocking), `_runner` (one wizard at a time: rail, page, gate). `parts` has the
building blocks of pages, `pages` the pages. Steps, gates and numbers are in
`ocmm_core.calibration`. It must not import the inspector's screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.wizards._driver import WizardDriver
    from ocmm_gui.wizards._registry import WIZARDS
    from ocmm_gui.wizards._runner import GuidedStack, Runner
    from ocmm_gui.wizards._site import (
        SESSIONS, PracticeRoom, ProbeWizardSite, Subject, WizardSite, practice_site, site_of,
        temperature,
    )  # fmt: skip
    from ocmm_gui.wizards._wizard import Wizard
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "SESSIONS", "WIZARDS", "GuidedStack", "PracticeRoom", "ProbeWizardSite", "Runner", "Subject",
    "Wizard", "WizardDriver", "WizardSite", "practice_site", "site_of", "temperature",
]  # fmt: skip
