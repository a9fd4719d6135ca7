"""Results of an audit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from ocmm_core.seals import SealState, Signed


class AuditedKind(StrEnum):
    """Kinds of files and folders."""

    JOB = "job"
    CAMERAS = "calibrations of cameras"
    PROBE = "calibrations of a probe"
    REPORT = "report"
    CERTIFICATE = "certificate"
    ACCEPTANCE = "acceptance"
    TEST = "acceptance session"
    INTERIM = "interim checks"
    STUDY = "study"
    ARTEFACTS = "artefacts"
    RECALL = "recall"
    PLAN = "plan"
    TEMPLATE = "template"
    DOCUMENT = "document"
    SETTINGS = "settings"
    OTHER = "file"


@dataclass(frozen=True, slots=True)
class AuditedRecord:
    """A kind of signed JSON record; packages add theirs by entry points of `ocmm.records`."""

    family: str
    """Of its schema, without the version."""
    kind: type[Any]
    signed: Signed
    words: Callable[[Any], str]
    """Returns what such a record says, in some words."""


@dataclass(frozen=True, slots=True)
class AuditRow:
    """A step: when (ISO 8601), by whom (may be empty), and what."""

    utc: str
    who: str
    what: str


@dataclass(frozen=True, slots=True)
class Audit:
    path: Path
    kind: AuditedKind
    signer: SealState
    faults: tuple[str, ...]
    """Sentences; empty if it is intact."""
    rows: tuple[AuditRow, ...]
    """Steps, oldest first."""
    proofs: tuple[str, ...] = ()
    """Further findings that are no faults, in sentences."""

    adopted: tuple[str, ...] = ()
    """Adopted steps: by whom, why, and suspicions, in sentences."""

    @property
    def intact(self) -> bool:
        """Return whether a trusted station wrote it, and it is unchanged."""
        return not self.faults and not self.adopted

    @property
    def word(self) -> str:
        if self.faults:
            return "NOT INTACT"
        return "ADOPTED" if self.adopted else "INTACT"
