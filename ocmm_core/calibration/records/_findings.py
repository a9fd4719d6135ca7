"""Findings against a calibration, with remedies, and which of them may be overruled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocmm_core.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding against a calibration."""

    code: str
    what: str
    remedy: str
    """`code`, `what`, `remedy`: As in `OcmmError`."""
    refuses: bool
    forcible: bool = False
    """The user may overrule it."""


def let_pass(findings: Sequence[Finding], force: bool) -> tuple[Finding, ...]:
    """Return the warnings; with ``force`` also the overruled refusals.

    CalibrationError if a finding refuses, first of all one that cannot be forced.
    """
    hard = [one for one in findings if one.refuses and not (one.forcible and force)]
    hard.sort(key=lambda one: one.forcible)
    if hard:
        remedy = hard[0].remedy
        if hard[0].forcible:
            remedy += " If you know why this is right, you can override it with a reason."
        raise CalibrationError(hard[0].code, hard[0].what, remedy)
    return tuple(replace(one, refuses=False) for one in findings)
