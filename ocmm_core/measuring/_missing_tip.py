"""Reasons for frames without tip: which camera misses which LED of which body."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.measuring._point import Refusal, RefusalCode
from ocmm_core.tracking import FrameStatus, ReferenceTrack, TrackBlock


def explain(window: TrackBlock, rig: Rig, time_s: float) -> Refusal:
    """Return the refusal for a window with too few frames with a tip."""
    bad = window.status[window.status != FrameStatus.OK]
    worst = FrameStatus(int(np.bincount(bad).argmax()))
    if worst is FrameStatus.REFERENCE_LOST and window.reference is not None:
        return explain_reference(window.reference, rig, time_s)
    if worst is FrameStatus.DOUBTFUL:
        return Refusal(
            RefusalCode.DOUBTFUL,
            "The spots do not fit the probe: a reflection, a wrong probe or a moved camera.",
            "Cover reflections and check the probe. If it persists, verify the cameras.",
            time_s,
        )
    if worst is FrameStatus.UNIDENTIFIED:
        return Refusal(
            RefusalCode.UNIDENTIFIED,
            "The LEDs are seen but cannot be identified uniquely.",
            "Turn the probe so that all its LEDs face the cameras.",
            time_s,
        )
    return Refusal(
        RefusalCode.LOST,
        _who_sees_nothing(window, worst, rig, "the probe", "LED ", ""),
        "Turn the LEDs towards the cameras and clear the line of sight, then touch again.",
        time_s,
    )


def explain_reference(seen: ReferenceTrack, rig: Rig, time_s: float) -> Refusal:
    """Return the refusal for a window in which the reference body failed."""
    body = seen.body
    bad = body.status[body.status != FrameStatus.OK]
    if not len(bad):
        return Refusal(
            RefusalCode.REFERENCE,
            "The position of the reference body is not known yet.",
            "Let part and cameras come to rest until the machine is ready.",
            time_s,
        )
    worst = FrameStatus(int(np.bincount(bad).argmax()))
    if worst is FrameStatus.DOUBTFUL:
        return Refusal(
            RefusalCode.REFERENCE,
            "The spots do not fit the reference body: a reflection, another body or a moved "
            "camera.",
            "Cover reflections and check the reference body. If it persists, verify the cameras.",
            time_s,
        )
    if worst is FrameStatus.UNIDENTIFIED:
        return Refusal(
            RefusalCode.REFERENCE,
            "The reference body is not recognised among the visible lights.",
            "Clear the line of sight to all its LEDs and cover reflections.",
            time_s,
        )
    why = _who_sees_nothing(body, worst, rig, "the reference body", "", "R")
    return Refusal(
        RefusalCode.REFERENCE,
        f"Reference body not visible. {why}",
        "Keep hand and probe out of the line of sight to its LEDs, then touch again.",
        time_s,
    )


def _who_sees_nothing(
    window: TrackBlock, status: FrameStatus, rig: Rig, what: str, before: str, each: str
) -> str:
    """Return the sentence that names the cameras and their hidden LEDs.

    Only frames of ``status`` count: in the others, before the view was hidden, all may be seen.
    ``before`` precedes all LED numbers, ``each`` each of them.
    """
    hidden = np.mean(np.isfinite(window.uv[window.status == status, ..., 0]), axis=0) < 0.5
    if hidden.all():
        return f"The cameras do not see {what}."
    parts = []
    for camera, leds in zip(rig.cameras, hidden, strict=True):
        if leds.any():
            numbers = ", ".join(f"{each}{led + 1}" for led in np.flatnonzero(leds))
            absent = what if leds.all() else f"{before}{numbers}"
            parts.append(f"Camera {camera.name} does not see {absent}.")
    # Whole sentences: fragments joined at run time cannot be translated.
    return " ".join(parts) or "Too few targets are seen by two cameras."
