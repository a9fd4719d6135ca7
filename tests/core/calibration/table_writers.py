"""Tables as the readers of reference points, spots, shots and sweeps read them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.cameras import KnownPoints, SpotTable
from ocmm_core.calibration.guided import Shot
from ocmm_core.calibration.pivot import PivotSweep
from ocmm_core.camera import Rig

SHOTS = ("shot", "kind", "place", "serial", "led", "u", "v")
SWEEPS = ("sweep", "frame", "serial", "led", "u", "v")


def write_reference_points(points: KnownPoints) -> bytes:
    """Return a list in mm with decimal points."""
    lines = [
        "# ocmm reference points",
        "# unit: mm",
        f"# uncertainty: {points.sigma!r}",
        f"# length uncertainty: {points.length_sigma!r}",
        f"# frame: {points.frame}",
        "name,x,y,z",
    ]
    for name, position in zip(points.names, points.positions_world.tolist(), strict=True):
        lines.append(",".join([name, *(repr(value) for value in position)]))
    return ("\n".join(lines) + "\n").encode()


def write_spots(spots: SpotTable, names: Sequence[str]) -> bytes:
    """Return a table; ``names`` are those of the reference points."""
    lines = ["# ocmm spots", f"# sigma: {spots.sigma_px!r}", "point,serial,u,v"]
    for serial, camera in zip(spots.serials, spots.uv, strict=True):
        for name, (u, v) in zip(names, camera.tolist(), strict=True):
            if np.isfinite(u) and np.isfinite(v):
                lines.append(f"{name},{serial},{u!r},{v!r}")
    return ("\n".join(lines) + "\n").encode()


def write_shots(shots: Sequence[Shot], rig: Rig) -> bytes:
    """Return a table; all shots must have the same sigma."""
    lines = ["# ocmm shots", f"# sigma: {shots[0].sigma_px!r}", ",".join(SHOTS)]
    for number, shot in enumerate(shots, start=1):
        for camera, of_camera in zip(rig.cameras, shot.uv.tolist(), strict=True):
            for led, (u, v) in enumerate(of_camera, start=1):
                if np.isfinite(u) and np.isfinite(v):
                    lines.append(
                        f"{number},{shot.kind},{shot.place},{camera.serial},{led},{u!r},{v!r}"
                    )
    return ("\n".join(lines) + "\n").encode()


def write_sweeps(sweeps: Sequence[PivotSweep], rig: Rig) -> bytes:
    """Return a table; all frames must have the same sigma."""
    sigma_px = float(sweeps[0].sigma_px[0])
    lines = ["# ocmm sweeps", f"# sigma: {sigma_px!r}", ",".join(SWEEPS)]
    for number, sweep in enumerate(sweeps, start=1):
        for frame, spots in enumerate(sweep.uv.tolist(), start=1):
            for camera, of_camera in zip(rig.cameras, spots, strict=True):
                for led, (u, v) in enumerate(of_camera, start=1):
                    if np.isfinite(u) and np.isfinite(v):
                        lines.append(f"{number},{frame},{camera.serial},{led},{u!r},{v!r}")
    return ("\n".join(lines) + "\n").encode()
