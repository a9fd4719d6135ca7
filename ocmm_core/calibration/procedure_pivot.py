"""Guided pivot calibration: the ball rests in a cone and the probe is swept about it, twice.

Steps: ``prepare``, ``first`` (the sweep that calibrates), ``second`` (an independent one, in
another place or attitude, that must show the same tip), ``result``.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.pivot_views import PivotView
from ocmm_core.calibration.probe_store import ProbeStore
from ocmm_core.calibration.procedure import Kind
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking.body import ProbeBody

CHANGE_LIMIT_MM = 0.03
POSES_WANTED = 400
TIP_SIGMA_MM = 0.01
VALID_DAYS = 365

PREPARE, FIRST, SECOND, RESULT = "prepare", "first", "second", "result"


class PivotProcedure:
    """See `procedure`; made by `begin` and `resume`.

    Drive it like every procedure: `watch` frames; whenever ``view.base.live.ready`` is set, `take`
    (a batch of poses, durable when it returns); when the gate of the step is open, `advance`. Start
    and end of a sweep come from the ball in its cone and from the coverage, nobody needs a key.
    All other calls of `procedure.Procedure` are there too: `drop` takes the last batch back, `back`,
    `force`, `compute`, `accept`, `keep`.
    """

    kind = Kind.PIVOT
    step_names = (PREPARE, FIRST, SECOND, RESULT)

    @classmethod
    def begin(
        cls,
        folder: Path,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        tip: str,
        now: datetime,
        *,
        who: str,
        temperature_c: float | None = None,
        tip_unknown: bool = False,
        cone: ArtefactUse | None = None,
        slack_mm: float = 0.0,
        change_limit_mm: float = CHANGE_LIMIT_MM,
        poses_wanted: int = POSES_WANTED,
        tip_sigma_mm: float = TIP_SIGMA_MM,
        valid_days: int = VALID_DAYS,
    ) -> PivotProcedure:
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
        tip_unknown
            The document does not say where this tip is (another stylus), and it was never
            calibrated: nothing is known of it but that it rests in the cone.
        cone
            Where it has a name.
        slack_mm
            Standard deviation of the ball's place in the cone, per axis; 0 where it rests.
        change_limit_mm
            From this change of the tip on, a person must say why.
        poses_wanted, tip_sigma_mm
            A sweep ends by itself with so many poses, full coverage, and the tip known so well.
        valid_days
            For how long the calibration may be used.

        Raises
        ------
        CalibrationError
            The tip has no name.
        StorageError
            The session file cannot be written.
        """
        raise NotImplementedError

    @classmethod
    def resume(cls, path: Path, rig: Rig, body: ProbeBody, store: ProbeStore) -> PivotProcedure:
        """Go on with a session where it stood; its file names the tip.

        Raises
        ------
        CalibrationError
            The session was begun with another rig or probe.
        StorageError
            The file cannot be read, or was changed.
        """
        raise NotImplementedError

    @property
    def view(self) -> PivotView:
        """Return the snapshot."""
        raise NotImplementedError

    def watch(self, block: FrameBlock) -> None:
        """Look at frames."""
        raise NotImplementedError

    def sweep_anew(self, now: datetime) -> None:
        """Throw away all poses of the current sweep, and wait for the ball in the cone again."""
        raise NotImplementedError

    def take_sweep(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Take recorded labelled spots (n, C, L, 2), px, NaN where not seen, into this sweep."""
        raise NotImplementedError

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result and end the procedure; see `procedure.Procedure.accept`.

        Raises
        ------
        CalibrationError
            The tip changed by more than the limit and ``reason`` is empty, or see there.
        """
        raise NotImplementedError
