"""Reference body of a job: the same one for all its points, or none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.storage import JobFile, JobReference
from ocmm_core.tracking import (
    PoseBatch,
    ProbeBody,
    ReferenceBody,
    ReferenceHome,
    TipSensitivity,
    home_of,
    motion_to_world,
    relative_sensitivities,
    solve_leds,
    spot_sigma_px,
    tip_sensitivities,
)


class ReferenceUse:
    """Keep a job with its initial reference body.

    MeasuringError if its points are relative to another reference body, or none, or if the cameras
    were recalibrated since.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        reference: ReferenceBody | None,
        job: JobFile,
        *,
        begun: bool,
    ) -> None:
        self.home: ReferenceHome | None = None
        """Pose of the reference body at the start of the job; None if not yet known."""
        self._rig, self._body, self._reference = rig, body, reference
        self._job = job
        stored = job.reference()
        if stored is not None and (reference is None or reference.identity != stored.identity):
            raise MeasuringError(
                "session.other_reference",
                f"{job.path}: the points of this job are relative to a reference body, and it is "
                + ("not given now." if reference is None else f"not '{reference.name}'."),
                "Choose the reference body the job was started with (Settings, Instrument), fixed "
                "as it was then; or start a new job.",
            )
        if stored is None and reference is not None and begun:
            raise MeasuringError(
                "session.no_reference",
                f"{job.path}: this job was measured without a reference body.",
                "Continue without a reference body (Settings, Instrument), or start a new job.",
            )
        if stored is not None and job.head.rig_identity != rig.identity:
            raise MeasuringError(
                "session.other_cameras",
                f"{job.path}: the cameras were recalibrated after this job was started; the "
                "position of the reference body at that time is unknown to the new calibration.",
                "Start a new job.",
            )
        if stored is not None and reference is not None:
            self.home = home_of(stored.spots, stored.n_frames, rig, reference)

    def keep(self, home: ReferenceHome) -> None:
        """Make the first pose of the body durable, once; StorageError: no point may be recorded."""
        if self.home is None and self._reference is not None:
            self._job.store_reference(JobReference(self._reference.text, home.spots, home.n_frames))
            self.home = home

    def sensitivity(self, spots: Float, reference_spots: Float | None) -> TipSensitivity:
        """Return the tip of mean spots (C, L, 2) and (C, R, 2), px, with its derivatives.

        TrackingError if no pose; MeasuringError if not relative to the reference body of the job.
        """
        return self.sensitivities([(spots, reference_spots)])[0]

    def sensitivities(
        self, observed: Sequence[tuple[Float, Float | None]]
    ) -> tuple[TipSensitivity, ...]:
        """Do the same as `sensitivity` for many points at once."""
        if not observed:
            return ()
        spots = _stacked([seen for seen, _ in observed])
        beside = [seen for _, seen in observed if seen is not None]
        if self._reference is None and not beside:
            return tip_sensitivities(spots, self._rig, self._body)
        if self._reference is None or self.home is None or len(beside) != len(observed):
            raise MeasuringError(
                "session.reference_home",
                "The position of the reference body at the start of the job is unknown.",
                "Let part and cameras come to rest until the machine is ready, then touch again.",
            )
        return relative_sensitivities(
            spots, _stacked(beside), self.home, self._rig, self._body, self._reference
        )

    def thesis_tip(self, spots: Float, reference_spots: Float | None) -> Float:
        """Return the tip (3,), mm, by the thesis; NaN without pose or the job's reference body."""
        if (self._reference is None) != (reference_spots is None):
            return np.full(3, np.nan)
        pose = self._thesis(spots, self._body.leds_probe, self._body.tip_probe)
        tip: Float = pose.tip_world[0]
        if self._reference is None or reference_spots is None:
            return tip
        if self.home is None:
            return np.full(3, np.nan)
        now = self._thesis(reference_spots, self._reference.leds.leds_body, np.zeros(3))
        turn, shift = motion_to_world(self.home, now.rotation_world_from_probe, now.origin_world)
        tip_world: Float = turn[0] @ tip + shift[0]
        return tip_world

    def _thesis(self, spots: Float, leds: Float, point: Float) -> PoseBatch:
        sigma_px = spot_sigma_px(self._rig)
        return solve_leds(spots[None], self._rig, leds, point, sigma_px, "thesis")


def _stacked(spots: Sequence[Float]) -> Float:
    shapes = sorted({one.shape for one in spots})
    if len(shapes) > 1:
        words = " and of ".join(" x ".join(str(n) for n in shape) for shape in shapes)
        raise MeasuringError(
            "session.spots",
            f"The points of the job have spots of {words} numbers.",
            "They are of different cameras or probes: keep the file and begin a new job.",
        )
    return np.stack(spots)
