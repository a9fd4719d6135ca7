"""What a step of a plan shows and how it is touched: checked when the plan is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from ocmm_core.documents import shortened, stays_inside
from ocmm_core.features.shapes import NominalFeature, Shape

LONGEST_TEXT = 500
WITH_TARGETS = (Shape.PLANE, Shape.CYLINDER, Shape.CONE, Shape.SPHERE, Shape.TORUS)
"""Shapes whose surface says at any place which way it looks."""
MOST_TARGETS = 1000
FARTHEST_MM = 1e6
PICTURES = (".png", ".jpg", ".jpeg", ".svg", ".webp")


def step_fault(feature: NominalFeature, by_plan: str) -> tuple[str, str] | None:
    """Return field and fault of a feature's text, picture or compensation; None where all is well.

    Parameters
    ----------
    by_plan
        Compensation that the plan says for features that say none.
    """
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
    # The axis of the probe stands on a face; along a bore it says nothing about the wall.
    if method == "shank" and feature.shape.spec.is_curved:
        return "compensation", (
            f"is 'shank', but the probe axis does not determine the probe side of a {shape}"
        )
    # A line does not name its face; every other shape says where its surface looks to.
    if method == "nominal" and feature.shape is Shape.LINE:
        return "compensation", f"is 'nominal', but the plan does not say which way a {shape} faces"
    return None


def targets_fault(feature: NominalFeature) -> str:
    """Return what is wrong with the targets of a feature; empty where nothing is."""
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
    """Return what is wrong with the name of a picture; empty where nothing is, or none is given."""
    return file_fault(picture, "picture", PICTURES) if picture else ""


def file_fault(name: str, what: str, endings: Sequence[str]) -> str:
    """Return what is wrong with the name of a file beside the plan; empty where nothing is.

    It stays beside the plan or in a folder there: an absolute path or one that climbs out would
    show any file of the computer, on every computer another one.
    """
    if not stays_inside(name):
        return f"is {shortened(name)}, which does not stay beside the plan"
    if PurePosixPath(name).suffix.lower() not in endings:
        return f"is {shortened(name)}; a {what} ends in one of: {', '.join(endings)}"
    return ""
