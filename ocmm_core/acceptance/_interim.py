"""Chart of interim checks, to detect changes of the instrument.

The first 25 checks set centre c and s. Then a check with error e and z = (e - c) / s signals if |z|
> 3 (Shewhart), if eight in a row lie on one side, or if a cumulative sum C+ = max(0, C+ + z - 1/2),
C- likewise, exceeds 5 (CUSUM). A single signal occurs by chance once in some hundred checks, so it
is repeated at once; if the repeat lies on the same side beyond 2 s the check is out, otherwise the
sums restart. Beyond the hard limit, half of the permissible error, it is out after the repeat
whatever the chart shows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acceptance._result import AcceptanceRecord
from ocmm_core.calibration.records import CalibrationStore, record_hash
from ocmm_core.chain_file import ChainFile
from ocmm_core.seals import Signed

INTERIM = "interim.chain"
"""File of all checks in a folder."""
LEARNING = 25
_SHEWHART, _RUN = 3.0, 8
_CUSUM_K, _CUSUM_H = 0.5, 5.0
_CONFIRMED = 2.0
_LEAST_S_MM = 1e-4
"""A scatter below 0.1 µm indicates typed numbers, not measurements."""


class InterimWord(StrEnum):
    LEARNING = "learning"
    GOOD = "good"
    REPEAT = "repeat it now"
    STOP = "stop"


class InterimCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    utc: str
    calibration: str
    artefact: str
    tip: str
    """`calibration`, `artefact`, `tip`: hash, serial, name; one chart per combination."""
    error_mm: float
    limit_mm: float
    """`error_mm`, `limit_mm`: of the length, and the hard limit."""
    record: str = ""
    """Hash of its acceptance record; empty without one."""


@dataclass(frozen=True, slots=True)
class ChartPoint:
    check: InterimCheck
    z: float
    """(e - c) / s; NaN while learning."""
    high: float
    low: float
    """`high`, `low`: cumulative sums after it."""
    word: InterimWord
    reason: str


@dataclass(frozen=True, slots=True)
class InterimChart:
    """All checks of one calibration, artefact and tip."""

    points: tuple[ChartPoint, ...]
    """Oldest first."""
    centre: float
    sigma: float
    """`centre`, `sigma`: mm; NaN while learning."""
    last_good: datetime | None
    """Time of the last good check, or None."""
    doubt: str = ""
    """State of the signature if the chart is not vouched for, e.g. NOT SIGNED; else empty."""

    @property
    def word(self) -> InterimWord:
        """Return the result of the last check."""
        return self.points[-1].word if self.points else InterimWord.LEARNING


def interim_chart(checks: Sequence[InterimCheck]) -> InterimChart:
    """Return the chart of checks, oldest first."""
    points: list[ChartPoint] = []
    learnt: list[float] = []
    centre = sigma = math.nan
    high = low = 0.0
    side = run = 0
    asked = ""
    toward = 0
    good: datetime | None = None
    for check in checks:
        error, z = check.error_mm, math.nan
        beyond = not abs(error) <= check.limit_mm
        repeat, asked = asked, ""
        reason = ""
        if beyond:
            toward = 1 if error > 0.0 else -1
            reason = (
                f"The error is {1e3 * error:+.1f} µm; {1e3 * check.limit_mm:.1f} µm are allowed."
            )
        if len(learnt) >= LEARNING:
            z = (error - centre) / sigma
            high, low = max(0.0, high + z - _CUSUM_K), max(0.0, low - z - _CUSUM_K)
            sign = 1 if z > 0.0 else -1
            run = run + 1 if sign == side else 1
            side = sign
            if repeat and not beyond:
                if z * toward > _CONFIRMED:
                    reason = repeat
                else:
                    high = low = 0.0
                    run = 0
            elif not beyond:
                reason, toward = _signal(z, high, low, run, side)
        word = InterimWord.GOOD if len(learnt) >= LEARNING else InterimWord.LEARNING
        if reason:
            word = InterimWord.STOP if repeat else InterimWord.REPEAT
            asked = "" if repeat else reason
        else:
            good = datetime.fromisoformat(check.utc)
            if len(learnt) < LEARNING:
                learnt.append(error)
                if len(learnt) == LEARNING:
                    centre = float(np.mean(learnt))
                    sigma = max(float(np.std(learnt, ddof=1)), _LEAST_S_MM)
        points.append(ChartPoint(check, z, high, low, word, reason))
    return InterimChart(tuple(points), centre, sigma, good)


def _signal(z: float, high: float, low: float, run: int, side: int) -> tuple[str, int]:
    """Return reason and side of a check's signal; empty if none."""
    if abs(z) > _SHEWHART:
        return f"The check lies {abs(z):.1f} s from the centre of its chart.", (
            1 if z > 0.0 else -1
        )
    if max(high, low) > _CUSUM_H:
        return "The checks drift: their cumulative sum is out.", (1 if high > low else -1)
    if run >= _RUN:
        return f"{run} checks in a row lie on one side of the centre.", side
    return "", 0


class InterimHistory:
    """Checks of a folder; on disk before `add` returns; StorageError if altered."""

    def __init__(self, folder: Path) -> None:
        self._chain: ChainFile[InterimCheck] = ChainFile(
            folder / INTERIM, InterimCheck, signed=Signed.INTERIM, remembered=True
        )

    @property
    def doubt(self) -> str:
        """Return why the chart is not trustworthy, as a sentence; empty if it is."""
        return self._chain.signer.fault if self._chain.items else ""

    def chart(self, calibration: str, artefact: str, tip: str) -> InterimChart:
        """Return the chart of one calibration, artefact and tip."""
        about = (calibration, artefact, tip)
        items = self._chain.items
        found = [one for one in items if (one.calibration, one.artefact, one.tip) == about]
        signer = self._chain.signer.word.value if self.doubt else ""
        return replace(interim_chart(found), doubt=signer)

    def add(self, check: InterimCheck) -> InterimChart:
        """Add a check, once, and return its chart; StorageError if it cannot be written."""
        if not check.record or all(one.record != check.record for one in self._chain.items):
            self._chain.append(check)
        return self.chart(check.calibration, check.artefact, check.tip)


def check_of(record: AcceptanceRecord) -> InterimCheck:
    """Return the chart entry of a check: its length error, or the value farthest off its limit."""
    counted = [one for one in record.values if not one.superseded]
    value = max(counted, key=lambda one: abs(one.error_mm) / one.limit_mm)
    length = next(one for one in counted if one.quantity == "Interim_L")
    chosen = value if abs(value.error_mm) > value.limit_mm else length
    return InterimCheck(
        utc=record.ended_utc, calibration=record.instrument.calibration,
        artefact=record.artefacts[0].use.serial, tip=record.instrument.tip,
        error_mm=chosen.error_mm, limit_mm=chosen.limit_mm, record=record_hash(record),
    )  # fmt: skip


def note_check(
    history: InterimHistory, record: AcceptanceRecord, store: CalibrationStore | None, now: datetime
) -> InterimChart:
    """Add a valid check to its chart; if out, mark the calibration suspect.

    In `store` (or None), measurements since the last good check, until a verification passes.
    """
    check = check_of(record)
    if record.void_reasons:
        return history.chart(check.calibration, check.artefact, check.tip)
    chart = history.add(check)
    if chart.word is InterimWord.STOP and store is not None:
        reason = f"The interim check is out ({record.number}): {chart.points[-1].reason}"
        # After an interruption this runs again; mark only once.
        if all(one.reason != reason for one in store.events):
            store.suspect(record.made_by, reason, chart.last_good, now)
    return chart
