"""The reference body as the station sees it: is it there, and how far was it carried."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.inspection.evaluation import ReferenceView, StatusWord
from ocmm_core.measuring import explain_reference
from ocmm_core.tracking import FrameStatus, ReferenceBody, TrackBlock, TrackingPipeline


def reference_view(
    track: TrackBlock, pipeline: TrackingPipeline, reference: ReferenceBody
) -> ReferenceView:
    """Return what is to be said about the reference body after the latest frame."""
    seen, home = track.reference, pipeline.home
    cameras = np.zeros(reference.n_leds)
    if seen is not None:
        cameras = np.count_nonzero(np.isfinite(seen.body.uv[-1, :, :, 0]), axis=0)
    moved_mm, turned_rad = pipeline.reference_motion or (None, None)
    leds = reference.leds.leds_body
    return ReferenceView(
        name=reference.name,
        n_leds=reference.n_leds,
        seen=int(np.count_nonzero(cameras >= 2)),
        moved_mm=moved_mm,
        turned_rad=turned_rad,
        leds_world=home.T_rig_from_reference.apply(leds) if home is not None else None,
    )


def judge_reference(
    track: TrackBlock, pipeline: TrackingPipeline, rig: Rig
) -> tuple[StatusWord, str]:
    """Return the word and the sentence for frames that have no place of the reference body."""
    seen = track.reference
    if seen is None:
        return StatusWord.NOT_READY, "Waiting for the cameras."
    status = FrameStatus(int(seen.body.status[-1]))
    if status is FrameStatus.OK:
        return StatusWord.NOT_READY, f"The reference body: {pipeline.reference_reason}."
    if status is FrameStatus.UNIDENTIFIED:
        return (
            StatusWord.LOST,
            f"The reference body is not recognised: {pipeline.reference_reason}.",
        )
    if status is FrameStatus.DOUBTFUL:
        return StatusWord.INACCURATE, "The spots do not fit the reference body."
    return StatusWord.LOST, explain_reference(seen, rig, 0.0).what
