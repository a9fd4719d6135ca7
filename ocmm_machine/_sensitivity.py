"""One characteristic of the parts: its deviation, U, and its growth with each offset."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_machine._document import ControlOffset, CorrectionDocument, Drive, vector_of
from ocmm_machine._facts import MeasuredValue, PartFacts

_SIZES = {"diameter": 1.0, "width": 1.0, "radius": 0.5}
"""Kinds of sizes, as parts of a diameter."""


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """One characteristic: deviation, U, and its sensitivity to every offset."""

    deviation: float
    expanded: float
    slopes: tuple[float, ...]
    weight: float
    why: str
    """Why it does not count; the numbers are then not used."""

    @property
    def counts(self) -> bool:
        return not self.why and self.weight > 0.0

    def after(self, changes: Float) -> float:
        """Return the deviation after changes of all offsets."""
        return self.deviation + float(np.array(self.slopes) @ changes)


def row_of(
    document: CorrectionDocument,
    drive: Drive,
    parts: Sequence[PartFacts],
    values: Mapping[str, float],
) -> SensitivityRow:
    """Return the row of a drive from its parts; it does not count unless proven in all of them."""
    found = [part.values.get(drive.characteristic) for part in parts]
    why = next(filter(None, map(_refusal, parts, found)), "")
    last, stated = found[-1], [one.result.stated for one in found if one is not None]
    if why or last is None or None in stated:
        return SensitivityRow(0.0, 1.0, (0.0,) * len(document.offset), 0.0, why)
    numbers = np.array(stated, dtype=np.float64)
    level, expanded = _level(document.method, numbers[:, 1], float(numbers[:, 2].max()))
    slopes = tuple(
        _slope(document, drive, one, last, parts[-1], values) if one.name in drive.offsets else 0.0
        for one in document.offset
    )
    return SensitivityRow(level, expanded, slopes, drive.weight, "")


def _refusal(part: PartFacts, measured: MeasuredValue | None) -> str:
    """Return why a value does not count, as a sentence; empty if it does."""
    if measured is None:
        return f"{part.job} has no such characteristic."
    if measured.result.kind == "coordinate" and not part.aligned:
        return f"{part.job} has no part frame."
    return measured.refusal


def _level(method: str, deviations: Float, expanded: float) -> tuple[float, float]:
    """Return the deviation to be corrected and its U, with the scatter from part to part."""
    count = len(deviations)
    if method == "last" or count < 2:
        return float(deviations[-1]), expanded
    at = np.arange(count) - (count - 1) / 2.0
    if method == "mean" or count < 3:
        level, freedom, lever = float(deviations.mean()), count - 1, 1.0 / count
        residuals = deviations - level
    else:
        slope = float(at @ deviations / (at @ at))
        level = float(deviations.mean()) + slope * (at[-1] + 1.0)
        residuals = deviations - deviations.mean() - slope * at
        freedom, lever = count - 2, 1.0 / count + (at[-1] + 1.0) ** 2 / (at @ at)
    scatter = math.sqrt(residuals @ residuals / freedom * lever)
    return level, math.hypot(expanded, float(stats.t.ppf(0.975, freedom)) * scatter)


def _slope(
    document: CorrectionDocument,
    drive: Drive,
    offset: ControlOffset,
    measured: MeasuredValue,
    part: PartFacts,
    values: Mapping[str, float],
) -> float:
    """Return the growth of a deviation with an offset; InputError if it cannot be meant."""
    kind, axis = measured.result.kind, measured.axis
    if drive.acts in ("outer", "inner"):
        if kind not in _SIZES:
            raise _contradiction(drive, "acts", f"it is a {kind}, not a size")
        grown = _SIZES[kind] * (2.0 if offset.counts == "radius" else 1.0)
        # A larger radius keeps the cutter away from the material: shafts grow, bores shrink. The X
        # of a turning tool moves away from the axis: both grow.
        return -grown if offset.kind == "radius" and drive.acts == "inner" else grown
    assert drive.direction  # noqa: S101 - checked with the document
    R_machine_from_part = document.frame.R_machine_from_part
    along = R_machine_from_part @ vector_of(drive.direction)
    if kind not in ("coordinate", "distance"):
        raise _contradiction(drive, "acts", f"it is a {kind}, not a place or distance")
    if kind == "coordinate" and drive.direction != f"+{axis.upper()}":
        raise _contradiction(drive, "direction", f"the coordinate counts along +{axis.upper()}")
    if kind == "distance" and axis and drive.direction[1] != axis.upper():
        raise _contradiction(drive, "direction", f"the distance is along {axis.upper()}")
    if offset.kind != "work":
        return float(along[2])
    if offset.axis == "c":
        feature = drive.feature or measured.result.features[0]
        place = part.places.get(feature)
        if place is None:
            raise _contradiction(drive, "feature", f"'{feature}' has no nominal place")
        x, y, _ = R_machine_from_part @ (place - np.array(document.frame.origin))
        return math.radians(1.0) * float(along @ (-y, x, 0.0))
    # In the document at most once; a rotation that is not in it is zero.
    turn = sum(
        math.radians(values[one.name])
        for one in document.offset
        if one.axis == "c" and one.number == offset.number
    )
    c, s = math.cos(turn), math.sin(turn)
    x, y, z = along
    return float({"x": c * x - s * y, "y": s * x + c * y, "z": z}[offset.axis])


def _contradiction(drive: Drive, field: str, why: str) -> InputError:
    return InputError(
        "correction.drive",
        f"Field '{field}' of drive '{drive.characteristic}' contradicts the plan: {why}.",
        "Correct the document of corrections.",
    )
