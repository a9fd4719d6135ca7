"""Time of the bundle adjustment against Ceres, as COLMAP's adjuster uses it, on the same problem.

Thesis rig, 10,000 poses of the probe with known LEDs: cameras, lenses and poses are sought, from a
start 10 mm, 0.6 degrees, 2 % and 20 px off without distortion. COLMAP's model OPENCV has the same
eight lens parameters. Ceres gets its quickest linear solver here, found by trying (the automatic
choice of COLMAP is one of them); both stop where chi-square falls by less than 1e-10 of itself.
Both have one thread. Run: ``python -m benchmarks.bundle``.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import pycolmap  # noqa: E402 - as above
from pycolmap import pyceres  # noqa: E402 - as above

from ocmm_core.calibration.bundle import BundleState, adjust  # noqa: E402 - as above
from ocmm_core.calibration.relocation import RelocationOptions, RelocationProblem, build  # noqa: E402 - above
from ocmm_core.camera import CameraModel  # noqa: E402 - as above
from ocmm_core.geometry import RigidTransform  # noqa: E402 - as above
from tests.core.calibration.waved_probe import SIGMA_PX, disturbed, observe, probe, rig, world  # noqa: E402 - as above

RATIO_LIMIT = 5.0
SAME_MINIMUM = 1e-4
"""Relative difference of chi-square that may be left."""

SOLVERS = {
    "automatic": None,
    "sparse normal Cholesky": pyceres.LinearSolverType.SPARSE_NORMAL_CHOLESKY,
    "sparse Schur": pyceres.LinearSolverType.SPARSE_SCHUR,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an adjustment went.

    Attributes
    ----------
    seconds
        Processor time of the adjustment alone.
    chi2
        At its end.
    iterations
        Until then.
    focals
        mm.
    """

    seconds: float
    chi2: float
    iterations: int
    focals: tuple[float, ...]


def problem(frames: int, seed: int) -> RelocationProblem:
    """Return the problem that both solve."""
    true = world(seed, body=probe(1e-9))
    observed = observe(true, frames, placements=0)
    options = RelocationOptions(lens="free", geometry="known")
    return build(disturbed(rig(), true.rng), true.body, observed, options)


def with_ours(given: RelocationProblem) -> Outcome:
    """Adjust with the product's engine."""
    began = time.process_time()
    found = adjust(given.data, given.prior, given.start)
    seconds = time.process_time() - began
    assert found.converged
    focals = tuple(camera.focal for camera in found.state.cameras)
    return Outcome(seconds, found.cost, found.iterations, focals)


def with_colmap(given: RelocationProblem, solver: pyceres.LinearSolverType | None) -> Outcome:
    """Adjust with COLMAP's adjuster."""
    reconstruction = _reconstruction(given)
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in reconstruction.reg_image_ids():
        config.add_image(image_id)
    for point_id in reconstruction.point3D_ids():
        config.add_constant_point(point_id)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = True
    options.refine_points3D = False
    options.print_summary = False
    options.ceres.auto_select_solver_type = solver is None
    settings = options.ceres.solver_options
    settings.function_tolerance = 1e-10
    settings.gradient_tolerance = 1e-10
    settings.max_num_iterations = 200
    settings.num_threads = 1
    if solver is not None:
        settings.linear_solver_type = solver
    options.ceres.solver_options = settings
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    began = time.process_time()
    summary = adjuster.solve()
    seconds = time.process_time() - began
    pitch = given.start.cameras[0].pitch_mm
    focals = tuple(
        float(reconstruction.camera(index + 1).params[1]) * pitch
        for index in range(len(given.start.cameras))
    )
    assert isinstance(summary, pycolmap.CeresBundleAdjustmentSummary)
    # Ceres counts half of the squared residuals, in pixels.
    chi2 = 2.0 * summary.ceres_summary.final_cost / SIGMA_PX**2
    return Outcome(seconds, chi2, summary.ceres_summary.num_successful_steps, focals)


def _reconstruction(given: RelocationProblem) -> pycolmap.Reconstruction:
    """Return the start as COLMAP has it: the probe is the world, the rig of cameras moves."""
    state = given.start
    whole = pycolmap.Reconstruction()
    rig_of_cameras = pycolmap.Rig()
    rig_of_cameras.rig_id = 1
    sensors = []
    for index, camera in enumerate(state.cameras):
        whole.add_camera(_camera(camera, index + 1))
        sensors.append(pycolmap.sensor_t(pycolmap.SensorType.CAMERA, index + 1))
        if index == 0:
            rig_of_cameras.add_ref_sensor(sensors[0])
        else:
            first = state.cameras[0].T_camera_from_world
            across = camera.T_camera_from_world.compose(first.inverse())
            rig_of_cameras.add_sensor(sensors[index], _rigid(across))
    whole.add_rig(rig_of_cameras)
    count = len(state.cameras)
    for led in state.leds:
        whole.add_point3D(led, pycolmap.Track(), np.zeros(3, dtype=np.uint8))
    for n in range(len(state.origins)):
        frame = pycolmap.Frame()
        frame.frame_id, frame.rig_id = n + 1, 1
        for index, sensor in enumerate(sensors):
            frame.add_data_id(pycolmap.data_t(sensor, n * count + index + 1))
        frame.rig_from_world = _rigid(_camera_from_probe(state, n))
        whole.add_frame(frame)
        for index in range(count):
            seen = np.flatnonzero(given.data.weights[n, index] > 0.0)
            points = [pycolmap.Point2D(given.data.uv[n, index, led], int(led) + 1) for led in seen]
            image = pycolmap.Image(
                name=f"{n}-{index}", points2D=pycolmap.Point2DList(points),
                camera_id=index + 1, image_id=n * count + index + 1,
            )  # fmt: skip
            image.frame_id = n + 1
            whole.add_image(image)
            for position, led in enumerate(seen):
                element = pycolmap.TrackElement(image.image_id, position)
                whole.point3D(int(led) + 1).track.add_element(element)
    return whole


def _camera(camera: CameraModel, index: int) -> pycolmap.Camera:
    f = camera.focal
    params = [
        f * camera.sx, f * camera.sy, camera.u0, camera.v0,
        camera.k1 * f**2, camera.k2 * f**4, camera.p2 * f, camera.p1 * f,
    ]  # fmt: skip
    return pycolmap.Camera(
        model="OPENCV", width=camera.width, height=camera.height, params=params, camera_id=index
    )


def _camera_from_probe(state: BundleState, n: int) -> RigidTransform:
    pose = RigidTransform(state.rotations[n], state.origins[n])
    return state.cameras[0].T_camera_from_world.compose(pose)


def _rigid(motion: RigidTransform) -> pycolmap.Rigid3d:
    return pycolmap.Rigid3d(np.hstack([motion.rotation, motion.translation[:, None]]))


def main() -> int:
    """Print the comparison; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=10_000, help="poses (10000)")
    parser.add_argument("--seed", type=int, default=1, help="seed (1)")
    options = parser.parse_args()
    with_ours(problem(50, options.seed))  # compiles
    given = problem(options.frames, options.seed)
    ours = min((with_ours(given) for _ in range(3)), key=lambda outcome: outcome.seconds)
    print(f"{options.frames} poses x 4 LEDs x 2 cameras   seconds        chi2  steps  f, mm")
    rows = {"ours": ours}
    for name, solver in SOLVERS.items():
        rows[f"Ceres, {name}"] = with_colmap(given, solver)
    for name, row in rows.items():
        focals = " ".join(f"{focal:.5f}" for focal in row.focals)
        print(f"{name:32} {row.seconds:8.3f} {row.chi2:11.2f} {row.iterations:6d}  {focals}")
    del rows["ours"]
    there = [row for row in rows.values() if row.chi2 <= (1.0 + SAME_MINIMUM) * ours.chi2]
    if not there:
        print("Ceres reached the minimum with no solver: no comparison")
        return 1
    ratio = min(row.seconds for row in there) / ours.seconds
    lower = min(row.chi2 for row in there) < (1.0 - SAME_MINIMUM) * ours.chi2
    holds = ratio >= RATIO_LIMIT and not lower
    print(f"ratio {ratio:.0f} (>= {RATIO_LIMIT:g})  {'ok' if holds else 'BROKEN'}")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
