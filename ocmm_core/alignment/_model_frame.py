"""Part frame of a best fit to model faces, with derivatives by the touches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment._best_fit import fit_points
from ocmm_core.alignment._model_fit import ModelFit, fit_to_faces
from ocmm_core.alignment._rules import ModelBestFit
from ocmm_core.errors import FitError
from ocmm_core.features.measured import SAME_RADIUS, ActualFeature, Touches
from ocmm_core.features.shapes import POINT
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.part_model import nearest_feet, searched

FAR_MM = 5.0
"""A touch farther from the faces belongs to others."""


def model_fit(
    rule: ModelBestFit,
    geometries: Mapping[str, Float],
    nominals: Mapping[str, Float],
    actual: Mapping[str, ActualFeature] | None,
) -> ModelFit:
    """Return the fit of touches to faces of the model.

    `geometries`, `nominals`: geometry vectors (12,), mm, world and frame of the nominals, by name.
    `actual`: the features as touched. None if only geometry is available, as for a nominal part:
    then its points are compared with the faces, which is equivalent for points on them. FitError: a
    nominal is missing, two balls were used, a touch is on none of the faces, or the faces leave a
    motion free.
    """
    missing = [name for name in rule.points if name not in nominals]
    if missing:
        raise FitError(
            "alignment.no_nominal",
            f"The best fit to the model needs the nominal place of {missing[0]}, which is unknown.",
            f"Give {missing[0]} a nominal, or leave it out of the best fit.",
        )
    measured = np.array([geometries[name][POINT] for name in rule.points])
    wanted = np.array([nominals[name][POINT] for name in rule.points])
    start = fit_points(measured, wanted, np.ones(len(wanted)))
    tips, radius = measured, 0.0
    if actual is not None:
        touched = [_only_touch(name, actual[name]) for name in rule.points]
        tips = np.array([one.tips[0] for one in touched])
        radius = touched[0].tip_radius
        if max(abs(one.tip_radius - radius) for one in touched) > SAME_RADIUS:
            raise FitError(
                "alignment.two_balls",
                "The points of the best fit to the model were touched with balls of two sizes.",
                "Touch all of them with one tip.",
            )
    faces = [searched(face) for face in rule.faces]
    # A misplaced one would distort the fit until others appear wrong.
    _check_near(rule, nearest_feet(start.apply(tips), faces).distances - radius, "Before")
    found = fit_to_faces(tips, radius, faces, start, names=rule.points)
    _check_near(rule, found.residuals, "After")
    return found


def _check_near(rule: ModelBestFit, residuals: Float, when: str) -> None:
    worst = int(np.argmax(np.abs(residuals)))
    if abs(residuals[worst]) > FAR_MM:
        name = rule.points[worst]
        raise FitError(
            "alignment.model_far",
            f"{when} the best fit to the model, {name} is {residuals[worst]:+.1f} mm off its "
            "faces.",
            f"Touch {name} again where it belongs, or name its face.",
        )


def model_frame_slopes(
    rule: ModelBestFit, found: ModelFit, actual: Mapping[str, ActualFeature]
) -> Rows:
    """Return the derivatives of the frame of a face fit by the points of the job, 6 rows."""
    places = [_only_touch(name, actual[name]).places[0] for name in rule.points]
    return Rows.of_points(places, found.by_tips).with_radius(found.by_radius)


def _only_touch(name: str, feature: ActualFeature) -> Touches:
    touches = feature.touches
    if touches is None or len(touches.tips) != 1:
        raise FitError(
            "alignment.model_points",
            f"The best fit to the model needs one touch of {name}, which is no single point.",
            f"Leave {name} out of the best fit.",
        )
    return touches
