"""Guided quick check of a tip, one minute: is it still the one that was qualified?

Steps: ``prepare``, ``sphere`` (13 points), ``cone`` (five attitudes), ``result``. A check that
cannot tell asks for more points; it never passes because of too large an uncertainty.
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
from ocmm_core.calibration.tip_views import TipCheckView
from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking.body import ProbeBody

PREPARE, SPHERE, CONE, RESULT = "prepare", "sphere", "cone", "result"


class TipCheckProcedure:
    """See `procedure`; made by `begin` and `resume`.

    Drive it like every procedure: `watch` frames; whenever ``view.base.live.ready`` is set, `take`;
    when the gate of the step is open, `advance`; in the last step `compute`, then `accept` (which
    stores the check, also one that failed) or `keep`. `drop` takes the last point back.
    """

    kind = Kind.TIP_CHECK
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
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipCheckProcedure:
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
        cameras
            Calibrations of the rig: a sphere that was used there is warned of.
        hold_s
            The ball must rest for so long after it is seen well, so that a hand has time to settle.

        Raises
        ------
        CalibrationError
            The tip is not mounted or was never qualified, or the sphere may not be used.
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
    ) -> TipCheckProcedure:
        """Continue the session of a file where it stopped; the file names tip and sphere.

        Raises
        ------
        CalibrationError
            It is empty, or was begun with another rig, probe, calibration or qualification.
        StorageError
            The file is not as it was written.
        """
        raise NotImplementedError

    @property
    def view(self) -> TipCheckView:
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
