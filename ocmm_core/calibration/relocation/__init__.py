"""Cameras calibrated where they stand: a waved probe, a length bar, one adjustment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.calibration.relocation._data import (
        GeometryMode,
        KeptByCameras,
        KeptByPoints,
        LengthBar,
        LensMode,
        Observations,
        ProbeFrames,
        RelocationOptions,
        ShownBar,
    )
    from ocmm_core.calibration.relocation._guards import judge_residuals
    from ocmm_core.calibration.relocation._problem import RelocationProblem, build
    from ocmm_core.calibration.relocation._procedure_relocation import (
        BARS_WANTED,
        LENGTH_LIMIT_MM,
        POSES_WANTED,
        RelocationProcedure,
    )
    from ocmm_core.calibration.relocation._relocation import relocate
    from ocmm_core.calibration.relocation._state import World
    from ocmm_core.calibration.relocation._steps import BAR
else:
    __getattr__ = door(
        __name__,
        _data=(
            "GeometryMode KeptByCameras KeptByPoints LengthBar LensMode Observations ProbeFrames "
            "RelocationOptions ShownBar"
        ),
        _guards="judge_residuals",
        _problem="RelocationProblem build",
        _procedure_relocation="BARS_WANTED LENGTH_LIMIT_MM POSES_WANTED RelocationProcedure",
        _relocation="relocate",
        _state="World",
        _steps="BAR",
    )

__all__ = [
    "BAR",
    "BARS_WANTED",
    "LENGTH_LIMIT_MM",
    "POSES_WANTED",
    "GeometryMode",
    "KeptByCameras",
    "KeptByPoints",
    "LengthBar",
    "LensMode",
    "Observations",
    "ProbeFrames",
    "RelocationOptions",
    "RelocationProblem",
    "RelocationProcedure",
    "ShownBar",
    "World",
    "build",
    "judge_residuals",
    "relocate",
]
