"""What the wizards are called, what they are for, and what they say when they end."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_gui.kit import later, tr


@dataclass(frozen=True, slots=True)
class EndTexts:
    """How a wizard ends."""

    accept: str
    keep: str
    """`accept`, `keep`: On the buttons that end it."""
    accepts: str
    keeps: str
    """`accepts`, `keeps`: What is asked before it ends."""


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
    """The words of one wizard."""

    title: str
    purpose: str
    """`title`, `purpose`: A few words, and what it is for."""
    ends: EndTexts
    """How it ends."""
    accepted: str
    """What is so after the result was accepted."""


def practice_title(title: str) -> str:
    """Return the title of a wizard in which nothing counts."""
    return tr("PRACTICE: {title}").format(title=title)
