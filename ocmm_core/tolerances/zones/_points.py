"""How many points a shape should have before its form is believed (BS 7172, NPL guide 41)."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.features.measured import ActualFeature


def points_note(features: Sequence[ActualFeature], *, of_form: bool) -> str:
    """Return what to know about few points, or nothing.

    Form from fewer points than recommended misses most of it; what else is measured with so few
    does not see the form at all.

    Parameters
    ----------
    features
        Whose points count.
    of_form
        The form of their surface is what is measured.
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
    # A sentence each: a list of them could not be told apart in another language.
    if of_form:
        return " ".join(f"Few points: {gap}." for gap in gaps)
    return " ".join(f"Form not evaluated: {gap}." for gap in gaps)
