"""Cameras calibrated where they stand, without a CMM: a waved probe, a length bar, one adjustment.

The probe is waved through the volume and the bar shown in some ten placements. One bundle
adjustment finds where the cameras stand, their lenses and, if wanted, the geometry of the probe.
"""

from __future__ import annotations

from ocmm_core.calibration.relocation_data import Observations, Relocation, RelocationOptions
from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking.body import ProbeBody


def relocate(
    start: Rig,
    body: ProbeBody,
    observed: Observations,
    options: RelocationOptions | None = None,
    force: bool = False,
) -> Relocation:
    """Return the cameras that see the waved probe and the bars as they were seen.

    Parameters
    ----------
    start
        Where the cameras stood before, to about 10 mm and half a degree, with lenses known to
        about 2 %; its `parameter_covariance` is what ``lens="prior"`` and ``"fixed"`` know.
    body
        The probe.
    observed
        Spots of probe and bars.
    options
        What is found anew; without, everything with the lenses known from before.
    force
        Overrule the guards that question the design of the calibration; each becomes a warning.

    Raises
    ------
    CalibrationError
        There are too few frames, no length gives the scale, a seat is not known, the frames do not
        determine the cameras, or a guard refuses.
    """
    raise NotImplementedError


def length_sigma(
    rig: Rig, volume_world: Float, length: float = 400.0, lines: int = 200, seed: int = 0
) -> float:
    """Return the RMS standard deviation, mm, that the cameras' covariance gives to lengths.

    Lengths lie at random, but always the same, in the volume (2, 3), mm. The noise of spots is not
    in it, so that this is the error that remains after any averaging.
    """
    raise NotImplementedError
