"""Data of a certificate of the machine; its facts and their clauses are in `_facts`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Literal, TypeVar

from ocmm_core.acceptance import RoomAir
from ocmm_core.calibration.records import PRACTICE, ArtefactUse, is_practice
from ocmm_core.export.template import Paper
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS

T = TypeVar("T")
Status = Literal["beforeAdjustment", "afterAdjustment"]

STATUS_WORDS: dict[Status, str] = {
    "beforeAdjustment": "as found",
    "afterAdjustment": "after adjustment",
}

PRACTICE_WORDS = "PRACTICE: made with a virtual hand on the virtual rig; valid for nothing."
SIMULATED_WORDS = "SIMULATED: the virtual rig was tested, no real machine."

K = 2.0
"""Coverage factor of every expanded uncertainty in the records."""


class Conformity(StrEnum):
    """Conformity of an error by ISO 14253-1, in the words of a DCC."""

    CONFORM = "pass"
    LEANING_IN = "conditionalPass"
    LEANING_OUT = "conditionalFail"
    NOT_CONFORM = "fail"

    @property
    def words(self) -> str:
        return {
            Conformity.CONFORM: "CONFORM",
            Conformity.LEANING_IN: "NOT PROVEN, leaning in",
            Conformity.LEANING_OUT: "NOT PROVEN, leaning out",
            Conformity.NOT_CONFORM: "NOT CONFORM",
        }[self]


@dataclass(frozen=True, slots=True)
class CertificateLine:
    """One error against its limit; mm."""

    name: str
    """Quantity and place."""
    measured: float
    reference: float
    """`measured`, `reference`: Indicated and certified."""
    expanded: float
    """U (k = 2) of the error."""
    limit: float
    """Permissible error (MPE)."""
    stated: Conformity | None = None
    """By the rule of a procedure; None for that of ISO 14253-1."""

    @property
    def error(self) -> float:
        return self.measured - self.reference

    @property
    def conformity(self) -> Conformity:
        """Return the conformity of the error: proven only with U inside or outside."""
        if self.stated is not None:
            return self.stated
        size = abs(self.error)
        if size + self.expanded <= self.limit:
            return Conformity.CONFORM
        if size - self.expanded > self.limit:
            return Conformity.NOT_CONFORM
        return Conformity.LEANING_IN if size <= self.limit else Conformity.LEANING_OUT


@dataclass(frozen=True, slots=True)
class CertificateRun:
    """One run of a test: as found, or after an adjustment."""

    status: Status
    made_utc: str
    made_by: str
    """`made_utc`, `made_by`: End, ISO 8601, and operator."""
    temperature_c: float | None
    """Ambient; None if not measured."""
    rule: str
    lines: tuple[CertificateLine, ...]
    """All that count, also failed ones."""
    passed: bool
    record: str
    data_sha256: str
    """`record`, `data_sha256`: Hashes of the record and of its observations."""
    notes: tuple[str, ...] = ()
    stated: Conformity | Literal["", "noPass"] = ""
    """Verdict in the words of a procedure, if more specific than ``passed``; may be empty."""
    air: RoomAir = field(default_factory=RoomAir)
    """Ambient humidity and pressure; empty if not read."""

    @property
    def word(self) -> str:
        """Return the verdict in the words of a DCC."""
        return str(self.stated) or ("pass" if self.passed else "fail")

    @property
    def words(self) -> str:
        if self.stated == "noPass":
            return "VOID: it shows nothing"
        if isinstance(self.stated, Conformity):
            return self.stated.words
        return "passed" if self.passed else "NOT passed"


@dataclass(frozen=True, slots=True)
class CertificateValue:
    r"""A value stated without a limit; ``expanded`` (k = 2) if known.

    ``unit`` is in the words of D-SI, such as ``\milli\metre``; ``\one`` for a plain number.
    """

    name: str
    value: float
    unit: str
    expanded: float | None = None


@dataclass(frozen=True, slots=True)
class Certificate:
    """Certificate of the machine; `values`, `values_before`: others, and before adjustment."""

    title: str
    """In-house: record or test report; "calibration certificate" requires an ``accreditation``."""
    number: str
    """From the hash of its record."""
    item: str
    identifications: tuple[tuple[str, str], ...]
    """`item`, `identifications`: names and values of serial numbers and hashes."""
    method: str
    norms: tuple[str, ...]
    """`method`, `norms`: In words, and by guideline."""
    software: str
    runs: tuple[CertificateRun, ...]
    """As found first. One if nothing was adjusted."""
    values: tuple[CertificateValue, ...]
    artefacts: tuple[ArtefactUse, ...]
    """Basis of traceability."""
    volume: str
    begin_utc: str
    end_utc: str
    """`begin_utc`, `end_utc`: Of the test, ISO 8601."""
    previous: str
    """Hash of the previous record; empty for the first one."""
    paper: Paper
    """Laboratory, customer, place."""
    accreditation: str = ""
    """As named in the procedure; may be empty."""
    simulated: bool = False
    camera_doubts: tuple[str, ...] = ()
    """Unproven properties of cameras, in sentences; the certificate states CAMERAS UNPROVEN."""
    values_before: tuple[CertificateValue, ...] = ()
    climate: tuple[tuple[str, float], ...] = ()
    """Further temperatures by object, degrees Celsius."""
    not_found: str = ""
    not_after: str = ""
    """`not_found`, `not_after`: why the state before or after adjustment is unknown, or ""."""

    @property
    def states(self) -> tuple[str, ...]:
        """Return the limitations of the certificate, a sentence each."""
        practised = self.title.startswith(PRACTICE)
        unproven = (f"{UNPROVEN_CAMERAS}: {' '.join(self.camera_doubts)}",)
        return (
            *((PRACTICE_WORDS if practised else SIMULATED_WORDS,) if self.simulated else ()),
            *(unproven if self.camera_doubts else ()),
        )

    @property
    def final(self) -> CertificateRun | None:
        """Return the run of the item's current state; None if there is none."""
        return self.runs[-1] if self.runs and not self.not_after else None

    @property
    def passed(self) -> bool:
        """Return the verdict on the item's current state."""
        return self.final is not None and self.final.passed


def marked(paper: Certificate, *made_by: str) -> Certificate:
    """Return a certificate with PRACTICE in its title if one of its records was practice."""
    if not any(map(is_practice, made_by)):
        return paper
    return replace(paper, title=f"{PRACTICE}: {paper.title}", simulated=True)


def once(items: Sequence[T]) -> tuple[T, ...]:
    """Return distinct artefacts or sentences in order."""
    return tuple(dict.fromkeys(items))
