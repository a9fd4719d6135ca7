"""The reference body as the station sees it: is it there, and how far was it carried."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.view import ReferenceView, StatusWord
from ocmm_core.measuring.stable_point import explain_reference
from ocmm_core.tracking.pipeline import TrackingPipeline
from ocmm_core.tracking.reference_body import ReferenceBody
from ocmm_core.tracking.result import FrameStatus, ReferenceTrack, TrackBlock


def reference_view(track: TrackBlock, reference: ReferenceBody) -> ReferenceView:
    """Return what is to be said about the reference body after the latest frame."""
    seen = track.reference
    if seen is None:
        return ReferenceView(reference.name, reference.n_leds, 0, None, None, None)
    cameras = np.count_nonzero(np.isfinite(seen.body.uv[-1, :, :, 0]), axis=0)
    moved, turned = _motion(seen)
    leds_world = None
    if seen.home is not None:
        leds_world = seen.home.T_rig_from_reference.apply(reference.leds.leds_body)
    return ReferenceView(
        name=reference.name,
        n_leds=reference.n_leds,
        seen=int(np.count_nonzero(cameras >= 2)),
        moved_mm=moved,
        turned_rad=turned,
        leds_world=leds_world,
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


def _motion(seen: ReferenceTrack) -> tuple[float | None, float | None]:
    """Return how far the middle of its LEDs is from home, mm, and its turn, rad."""
    good = np.flatnonzero(seen.body.status == FrameStatus.OK)
    if seen.home is None or not len(good):
        return None, None
    at_home = seen.home.T_rig_from_reference
    # Its middle is what the body was tracked with as its tip.
    rotations: Float = seen.body.rotation_world_from_probe[good]
    arm = rotations[-1].T @ (seen.body.tip_world[good[-1]] - seen.body.origin_world[good[-1]])
    moved = seen.body.tip_world[good].mean(axis=0) - at_home.apply(arm)
    change = rotations.mean(axis=0) @ at_home.rotation.T
    vector = 0.5 * np.array(
        [change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]]
    )
    return float(np.linalg.norm(moved)), float(np.linalg.norm(vector))
