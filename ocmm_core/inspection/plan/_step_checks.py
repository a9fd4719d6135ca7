"""Checks of a step's text, picture and compensation when the plan is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from ocmm_core.documents import shortened, stays_inside
from ocmm_core.features.shapes import NominalFeature, Shape

LONGEST_TEXT = 500
WITH_TARGETS = (Shape.PLANE, Shape.CYLINDER, Shape.CONE, Shape.SPHERE, Shape.TORUS)
"""Shapes whose surface has a normal at any place."""
MOST_TARGETS = 1000
FARTHEST_MM = 1e6
PICTURES = (".png", ".jpg", ".jpeg", ".svg", ".webp")


def step_fault(feature: NominalFeature, by_plan: str) -> tuple[str, str] | None:
    """Return field and fault of a feature's text, picture or compensation; None if valid."""
    if len(feature.text) > LONGEST_TEXT or not feature.text.replace("\n", " ").isprintable():
        return "text", f"is longer than {LONGEST_TEXT} characters, or contains non-printing ones"
    fault = picture_fault(feature.picture)
    if fault:
        return "picture", fault
    fault = targets_fault(feature)
    if fault:
        return "targets", fault
    method = feature.compensation or by_plan
    shape = feature.shape.value.lower()
    # The axis of the probe is normal to a face; along a bore it is parallel to the wall.
    if method == "shank" and feature.shape.spec.is_curved:
        return "compensation", (
            f"is 'shank', but the probe axis does not determine the probe side of a {shape}"
        )
    # A line does not name its face; all other shapes have a normal.
    if method == "nominal" and feature.shape is Shape.LINE:
        return "compensation", f"is 'nominal', but the plan does not say which way a {shape} faces"
    return None


def targets_fault(feature: NominalFeature) -> str:
    """Return the fault of a feature's targets; empty if none."""
    if not feature.targets:
        return ""
    if feature.shape not in WITH_TARGETS:
        words = ", ".join(shape.value.lower() for shape in WITH_TARGETS)
        return f"is only for: {words}"
    if len(feature.targets) > MOST_TARGETS:
        return f"has {len(feature.targets)} places; at most {MOST_TARGETS}"
    if not all(abs(value) <= FARTHEST_MM for target in feature.targets for value in target):
        return f"has a place farther away than {FARTHEST_MM:g} mm"
    return ""


def picture_fault(picture: str) -> str:
    """Return the fault of a picture's name; empty if none."""
    return file_fault(picture, "picture", PICTURES) if picture else ""


def file_fault(name: str, what: str, endings: Sequence[str]) -> str:
    """Return the fault of the name of a file next to the plan; empty if none.

    An absolute path or ``..`` would read any file of the computer, on every computer another one.
    """
    if not stays_inside(name):
        return f"is {shortened(name)}, which does not stay beside the plan"
    if PurePosixPath(name).suffix.lower() not in endings:
        return f"is {shortened(name)}; a {what} ends in one of: {', '.join(endings)}"
    return ""
