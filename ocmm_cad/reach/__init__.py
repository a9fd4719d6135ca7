"""Reachability of targets on a part by a probe, and visibility of its LEDs.

In: triangles of a part, places with normals, probe, rig, placement of the part.
Out: for each place an attitude of the probe, or the obstacle.

Read `_reach` (queries, the mesh as an obstacle), `_setting` (probe with its bodies, cameras,
placement, attitudes), and the compiled `_search_kernel` and `_tree_kernel`. It must not know files
of models, features or plans.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cad.reach._reach import (
        LEAST_LEDS, Obstacle, Reach, Reached, SurfaceTargets, make_obstacle,
    )  # fmt: skip
    from ocmm_cad.reach._setting import TILT_DEG, Setting, solid_of
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "LEAST_LEDS", "TILT_DEG", "Obstacle", "Reach", "Reached", "Setting", "SurfaceTargets",
    "make_obstacle", "solid_of",
]  # fmt: skip
