"""Reachability of targets on a part by a probe, and visibility of its LEDs.

In: triangles of a part, places with normals, probe, rig, placement of the part. Out: for each place
an attitude of the probe, or the obstacle.

Read `_reach` (queries), `_setting` (probe, cameras, placement, attitudes), `_probe_solid` (bodies
of a probe), `_part_in_the_way` (the mesh), and the compiled `_grow_kernel`, `_search_kernel` and
`_tree_kernel`. It must not know files of models, features or plans.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_cad.reach._part_in_the_way import Obstacle, make_obstacle
    from ocmm_cad.reach._probe_solid import solid_of
    from ocmm_cad.reach._reach import LEAST_LEDS, Reach, Reached, SurfaceTargets
    from ocmm_cad.reach._setting import TILT_DEG, Setting
else:
    __getattr__ = door(
        __name__,
        _part_in_the_way="Obstacle make_obstacle",
        _probe_solid="solid_of",
        _reach="LEAST_LEDS SurfaceTargets Reach Reached",
        _setting="Setting TILT_DEG",
    )

__all__ = [
    "LEAST_LEDS",
    "TILT_DEG",
    "Obstacle",
    "Reach",
    "Reached",
    "Setting",
    "SurfaceTargets",
    "make_obstacle",
    "solid_of",
]  # fmt: skip
