"""Wizards: guided calibration, relocation and verification, as pages over core procedures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.wizards._registry import WIZARDS, WizardSpec
    from ocmm_gui.wizards._runner import Runner
    from ocmm_gui.wizards._site import (
        SESSIONS,
        ProbeSite,
        Subject,
        WizardSite,
        site_of,
        temperature,
    )
    from ocmm_gui.wizards._wizard import Wizard
else:
    __getattr__ = door(
        __name__,
        _registry="WIZARDS WizardSpec",
        _runner="Runner",
        _site="ProbeSite SESSIONS Subject WizardSite site_of temperature",
        _wizard="Wizard",
    )

__all__ = [
    "SESSIONS",
    "WIZARDS",
    "ProbeSite",
    "Runner",
    "Subject",
    "Wizard",
    "WizardSite",
    "WizardSpec",
    "site_of",
    "temperature",
]
