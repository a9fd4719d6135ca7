"""Explain why a list of points does not fit its spots: order, handedness or unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration.cameras._guards import OUTLIERS_REFUSED, RMS_REFUSED, ratio_of
from ocmm_core.calibration.cameras._model_fit import fit_camera
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import CameraModel
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Pixels, Points3
from ocmm_core.units import named_unit

Pattern: TypeAlias = tuple[str, str, Points3, Pixels]

UNITS_MM = {
    word: named_unit(word, "length").factor
    for word in ("inches", "centimetres", "metres", "micrometres")
}
"""A list in one of these that was taken for millimetres makes the rig this much too small."""

UNIT_TOLERANCE = 0.15
"""Relative deviation of a baseline from the rig document within which the unit is named."""

MAX_BASELINE_RATIO = 1.5


def explain_misfit(
    nominal: CameraModel, points_world: Points3, uv: Pixels, sigma_px: float, reference_sigma: float
) -> Finding | None:
    """Return the mix-up of the list that makes it fit the spots, or None.

    (n, 3), mm, and (n, 2), px, in list order. Two swapped axes, one reversed axis, and swapped u
    and v differ by a rotation only, which the pose absorbs: they are named together.
    """
    for code, sentence, points, spots in _patterns(points_world, uv):
        try:
            fit = fit_camera(nominal, points, spots, sigma_px, reference_sigma)
        except CalibrationError:
            continue
        good = ratio_of(fit) < RMS_REFUSED and np.mean(~fit.used) <= OUTLIERS_REFUSED
        if good:
            return Finding(
                code,
                f"The list of points does not fit the spots of camera '{nominal.name}', but it "
                f"would {sentence}.",
                "Correct the list of points or of spots, and calibrate again.",
                refuses=True,
            )
    return None


def explain_baseline(first: str, second: str, found_mm: float, expected_mm: float) -> list[Finding]:
    """Return findings on the unit by the camera distance of the rig; residuals hide it."""
    ratio = found_mm / expected_mm
    said = (
        f"According to the list of points, cameras '{first}' and '{second}' are {found_mm:.4g} "
        f"mm apart, according to the rig document {expected_mm:.4g} mm"
    )
    for unit, size in UNITS_MM.items():
        for factor, problem in (
            (1.0 / size, f"the list is in {unit}, but declares mm"),
            (size, f"the list is in mm, but declares {unit}"),
        ):
            if abs(ratio / factor - 1.0) <= UNIT_TOLERANCE:
                return [
                    Finding(
                        "calibration.wrong_unit",
                        f"{said}: {problem}.",
                        "Correct the unit in the header of the list.",
                        refuses=True,
                    )
                ]
    if 1.0 / MAX_BASELINE_RATIO <= ratio <= MAX_BASELINE_RATIO:
        return []
    return [
        Finding(
            "calibration.baseline",
            f"{said}.",
            "Check the unit of the list, and the camera positions in the rig document.",
            refuses=True,
            forcible=True,
        )
    ]


def _patterns(points: Points3, uv: Pixels) -> Iterator[Pattern]:
    order = "calibration.wrong_order"
    yield order, "if the points were in reverse order", points[::-1], uv
    yield order, "if every spot belonged to the next point", points[1:], uv[:-1]
    yield order, "if every spot belonged to the previous point", points[:-1], uv[1:]
    yield (
        "calibration.wrong_axes",
        "if it were mirrored: two of its axes are swapped, one has the wrong sign, or u and v of "
        "the spots are swapped",
        points * np.array([1.0, 1.0, -1.0]),
        uv,
    )
