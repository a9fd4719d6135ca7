"""Bundle adjustment of cameras, probe and bars, with search for faulty elements.

In: spots in frames with unknown poses, lengths of bars, cameras with their priors.
Out: best-fit cameras, probe and poses, their covariance, wrong spots, and the faulty element.

Read `_state` (unknowns, order of columns, observations), `_bundle` (the adjustment) with `_kernel`
(elimination of poses), then `_robust` (first values, wrong spots). `_culprit` frees one suspect
after the other; `_culprit_history` and `_culprit_messages` give moment, point, and remedy. The
package is independent of procedures and sessions: arrays in, a solution out.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.bundle import _kernel as kernel
    from ocmm_core.calibration.bundle._bundle import adjust, common_covariance, linearise, residuals
    from ocmm_core.calibration.bundle._culprit import (
        Culprit, CulpritVerdict, FaultTrial, Suspect, examine, fit, trials_of,
    )  # fmt: skip
    from ocmm_core.calibration.bundle._culprit_history import Block, BlockHistory, restored
    from ocmm_core.calibration.bundle._culprit_messages import (
        Names, accuse, explain_points, scale_between,
    )  # fmt: skip
    from ocmm_core.calibration.bundle._kernel import N_CAMERA, eliminate
    from ocmm_core.calibration.bundle._robust import (
        RobustMinimum, adjust_robustly, solvable, start_bars, start_poses, start_shape,
    )  # fmt: skip
    from ocmm_core.calibration.bundle._state import BundleData, BundleState, Columns, Prior
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "N_CAMERA", "Block", "BlockHistory", "BundleData", "BundleState", "Columns", "Culprit",
    "CulpritVerdict", "FaultTrial", "Names", "Prior", "RobustMinimum", "Suspect", "accuse",
    "adjust", "adjust_robustly", "common_covariance", "eliminate", "examine", "explain_points",
    "fit", "kernel", "linearise", "residuals", "restored", "scale_between", "solvable",
    "start_bars", "start_poses", "start_shape", "trials_of",
]  # fmt: skip
