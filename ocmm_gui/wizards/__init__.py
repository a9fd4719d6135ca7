"""Wizards: guided calibration, relocation and verification, as pages over core procedures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards._runner import Runner
    from ocmm_gui.wizards._site import SESSIONS, ProbeSite, WizardSite, site_of, temperature
    from ocmm_gui.wizards._wizard import Wizard
else:
    __getattr__ = door(
        __name__,
        _runner="Runner",
        _site="ProbeSite SESSIONS WizardSite site_of temperature",
        _wizard="Wizard",
    )

__all__ = [
    "SESSIONS",
    "ProbeSite",
    "Runner",
    "Wizard",
    "WizardSite",
    "site_of",
    "temperature",
]
