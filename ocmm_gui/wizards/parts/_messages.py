"""Titles, purposes and final texts of the wizards."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_gui.kit import later, tr


@dataclass(frozen=True, slots=True)
class EndTexts:
    """Final texts of a wizard."""

    accept: str
    keep: str
    accepts: str
    keeps: str
    """`accepts`, `keeps`: confirmation questions."""


CALIBRATION_ENDS = EndTexts(
    later("Accept the new"), later("Keep the old"),
    later("Activate this calibration?"), later("End and keep the old calibration?"),
)  # fmt: skip
VERDICT_ENDS = EndTexts(
    later("Store the verdict"),
    later("Discard"),
    later("Store this verdict?"),
    later("End without a verdict?"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WizardTexts:
    title: str
    purpose: str
    ends: EndTexts
    accepted: str
    """Consequence of accepting the result."""


def practice_title(title: str) -> str:
    return tr("PRACTICE: {title}").format(title=title)
