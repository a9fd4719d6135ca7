"""What is said about one characteristic."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """The decision, in the word that the inspector reads."""

    CONFORM = "CONFORM"
    NOT_CONFORM = "NOT CONFORM"
    NOT_PROVEN = "NOT PROVEN"
    NOT_MEASURED = "NOT MEASURED"


@dataclass(frozen=True, slots=True)
class CharacteristicResult:
    """One characteristic with its value, uncertainty and verdict; lengths in mm.

    Attributes
    ----------
    name, kind, features
        As in the plan.
    nominal, lower, upper
        Nominal value and the limits of the deviation.
    measured, deviation
        None where there is no trustworthy value.
    uncertainty
        Expanded uncertainty U (k = 2); None together with ``measured``.
    verdict
        The decision.
    note
        Why there is no value, or what to know about it; may be empty.
    """

    name: str
    kind: str
    features: tuple[str, ...]
    nominal: float
    lower: float
    upper: float
    measured: float | None
    deviation: float | None
    uncertainty: float | None
    verdict: Verdict
    note: str = ""
