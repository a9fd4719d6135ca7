"""Uncertainty of a saved frame, from its document."""

from __future__ import annotations

import numpy as np

from ocmm_core.alignment._rules import (
    AnyAlignment,
    BestFit,
    BoundAlignment,
    ReferencePoints,
    SavedFrame,
)
from ocmm_core.geometry import RigidTransform
from ocmm_core.measuring import FrameDoubt


def saved_frame_in(rule: AnyAlignment | None) -> SavedFrame | None:
    """Return the saved frame of an alignment, as rule or start."""
    kind = rule.rule if isinstance(rule, BoundAlignment) else rule
    if isinstance(kind, (BestFit, ReferencePoints)):
        kind = kind.start
    return kind if isinstance(kind, SavedFrame) else None


def doubt_of(rule: AnyAlignment | None) -> FrameDoubt | None:
    """Return the uncertainty of a saved frame; None without one (see `unknown_frame`)."""
    saved = saved_frame_in(rule)
    if saved is None or not saved.covariance:
        return None
    T_frame_from_world = RigidTransform(np.array(saved.rotation), np.array(saved.translation))
    return FrameDoubt(T_frame_from_world, np.array(saved.covariance))


def unknown_frame(rule: AnyAlignment | None) -> str:
    """Return why a frame of unknown uncertainty proves nothing, or empty text."""
    saved = saved_frame_in(rule)
    if saved is None or saved.covariance:
        return ""
    return (
        f"The saved frame {saved.name} has no uncertainty: save it again (ocmm "
        "align), from a job that measured its features."
    )
