"""Guided qualification of a tip: a calibrated sphere touched all around, and the ball in a cone.

Steps: ``prepare``, ``sphere`` (25 points, ISO 10360-5 layout, and more where the diameter is not
yet known well enough), ``cone`` (five attitudes), ``result``.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.artefacts import Sphere
from ocmm_core.calibration.history import CalibrationStore
from ocmm_core.calibration.probe_store import ProbeStore
from ocmm_core.calibration.procedure import Kind
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.calibration.tip_views import TipView
from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking.body import ProbeBody

VALID_DAYS = 30

PREPARE, SPHERE, CONE, RESULT = "prepare", "sphere", "cone", "result"


class TipQualificationProcedure:
    """See `procedure`; made by `begin` and `resume`.

    Drive it like every procedure: `watch` frames; whenever ``view.base.live.ready`` is set, `take`;
    when the gate of the step is open, `advance`; in the last step `compute`, then `accept` (which
    stores the qualification, also one that failed) or `keep`. `drop` takes the last point back.
    """

    kind = Kind.QUALIFICATION
    step_names = (PREPARE, SPHERE, CONE, RESULT)

    @classmethod
    def begin(
        cls,
        folder: Path,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        tip: str,
        sphere: Sphere,
        now: datetime,
        *,
        who: str,
        temperature_c: float | None = None,
        cone: ArtefactUse | None = None,
        nominal_mm: float | None = None,
        valid_days: int = VALID_DAYS,
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipQualificationProcedure:
        """Begin a session.

        Parameters
        ----------
        folder
            Of session files.
        rig
            With the calibration in force.
        body
            The probe by its document.
        store
            Records of this probe.
        tip
            Name of the tip that is mounted.
        sphere
            On which the ball is measured.
        cone
            Where it has a name.
        nominal_mm
            Diameter that the ball should have; None is that of the document.
        valid_days
            For how long the qualification may be used.
        cameras
            Calibrations of the rig: a sphere that was used there is warned of.
        hold_s
            The ball must rest for so long after it is seen well, so that a hand has time to settle.

        Raises
        ------
        CalibrationError
            The tip is not mounted or was never calibrated, or the sphere may not be used.
        StorageError
            The session file cannot be written.
        """
        raise NotImplementedError

    @classmethod
    def resume(
        cls,
        path: Path,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        *,
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipQualificationProcedure:
        """Continue the session of a file where it stopped; the file names tip and sphere.

        Raises
        ------
        CalibrationError
            It is empty, or was begun with another rig, probe or calibration.
        StorageError
            The file is not as it was written.
        """
        raise NotImplementedError

    @property
    def view(self) -> TipView:
        """Return the snapshot."""
        raise NotImplementedError

    def watch(self, block: FrameBlock) -> None:
        """Look at frames."""
        raise NotImplementedError

    def take_shot(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Take recorded averaged spots (C, L, 2), px, as the next observation.

        Raises
        ------
        CalibrationError
            Nothing is taken in this step.
        """
        raise NotImplementedError

    def take_back(self, point: int, now: datetime) -> None:
        """Take back one observation of the current step by its index in the snapshot."""
        raise NotImplementedError
