"""Recommended numbers of points for form (BS 7172, NPL guide 41)."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.features.measured import ActualFeature


def points_note(features: Sequence[ActualFeature], *, of_form: bool) -> str:
    """Return a note on too few points, or nothing.

    Form from fewer points than recommended misses most of it; other quantities then do not reveal
    form at all. With ``of_form`` the measurand is the form of the surface.
    """
    few = [
        feature
        for feature in features
        if feature.touches is not None
        and len(feature.numbers) < feature.fit.shape.spec.recommended_points
    ]
    if not few:
        return ""
    gaps = [
        f"{feature.nominal.name} has {len(feature.numbers)} of "
        f"{feature.fit.shape.spec.recommended_points} recommended"
        for feature in few
    ]
    # One sentence each: lists would be ambiguous in other languages.
    if of_form:
        return " ".join(f"Few points: {gap}." for gap in gaps)
    return " ".join(f"Form not evaluated: {gap}." for gap in gaps)
