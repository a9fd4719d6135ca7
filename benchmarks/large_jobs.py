"""A job of many points: opened again, looked at, and gone on with.

    python -m benchmarks.large_jobs [--points 10000] [--features 500] [--report]

Spheres of 6 mm all over the volume, touched in turn with the rig and probe of the resources; spots
are those of the believed cameras with the white noise of the mean of the frames. ``opened`` is all
of `reopen_job`; ``view`` is what a session takes to be looked at for the first time, ``one more``
after one more point has come, the median of ten; all are processor times. Memory is what the
process holds at its peak, libraries with it. ``--report``: the PDF report of the opened job, with a
row for each feature, in addition. Ends with 1 if 10,000 points take longer than 3 s to
open or 20 ms for one more, or more than 600 MB.
"""

from __future__ import annotations

import argparse
import resource as limits
import sys
import tempfile
import time
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

import msgspec  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import numpy as np  # noqa: E402 - as above

from benchmarks.recall_scenes import PROBE, RIG  # noqa: E402 - as above
from ocmm_core.camera import load_rig, project  # noqa: E402 - as above
from ocmm_core.export.report import report_of_job  # noqa: E402 - as above
from ocmm_core.features.shapes import NominalFeature, Shape  # noqa: E402 - as above
from ocmm_core.geometry import rotation_from_vector  # noqa: E402 - as above
from ocmm_core.inspection.evaluation import SessionOptions  # noqa: E402 - as above
from ocmm_core.inspection.finished import reopen_job  # noqa: E402 - as above
from ocmm_core.inspection.plan import Plan, load_plan, save_plan  # noqa: E402 - as above
from ocmm_core.inspection.session import InspectionSession  # noqa: E402 - as above
from ocmm_core.measuring import MeasuredPoint  # noqa: E402 - as above
from ocmm_core.storage import JobFile, make_head  # noqa: E402 - as above
from ocmm_core.tolerances.zones import Characteristic  # noqa: E402 - as above
from ocmm_core.tracking import load_probe, solve, spot_sigma_px  # noqa: E402 - as above
from ocmm_gui.reports import drawing, write_pdf  # noqa: E402 - as above

_RADIUS = 3.0
_PITCH = 10.0
_COLUMNS = 20
_N_FRAMES = 500
_STEP = 5000
_OPENED_S, _MORE_S, _MEMORY_MB = 3.0, 0.020, 600.0


def large_plan(points: int, features: int, after: Path | None = None) -> Plan:
    """Return a plan of spheres, and of the features in ``after`` behind them."""
    centres = _centres(features)
    spheres = [
        NominalFeature(
            name=f"S{k}",
            shape=Shape.SPHERE,
            points=points // features,
            point=(float(x), float(y), float(z)),
            diameter=2.0 * _RADIUS,
        )
        for k, (x, y, z) in enumerate(centres)
    ]
    wanted = [
        Characteristic(
            name=f"D{k}", kind="diameter", features=[f"S{k}"], nominal=2.0 * _RADIUS,
            lower=-0.1, upper=0.1,
        )
        for k in range(features)
    ]  # fmt: skip
    if after is None:
        return Plan(
            schema="ocmm.plan/1", unit="mm", name="large", part="spheres", features=spheres,
            characteristics=wanted, rule="simple",
        )  # fmt: skip
    plan = load_plan(after)
    return msgspec.structs.replace(
        plan, features=[*spheres, *plan.features], characteristics=[*wanted, *plan.characteristics]
    )


def large_points(plan: Plan) -> list[MeasuredPoint]:
    """Return the points of the spheres of a plan, touched in turn."""
    rng = np.random.default_rng(1)
    rig, body = load_rig(RIG), load_probe(PROBE)
    spheres = [item for item in plan.features if item.name[1:].isdigit()]
    count = spheres[0].points * len(spheres)
    normals = rng.normal(size=(count, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    centres = np.resize(_centres(len(spheres)), (count, 3))
    tips = centres + (_RADIUS + body.tip_radius) * normals
    spots = []
    for tip in tips:
        rotation = rotation_from_vector(rng.normal(0.0, 0.1, 3))
        leds = (body.leds_probe - body.tip_probe) @ rotation.T + tip
        spots.append([project(camera, leds) for camera in rig.cameras])
    noise = rig.noise.white_px / np.sqrt(_N_FRAMES)
    seen = np.array(spots) + noise * rng.standard_normal(np.shape(spots))
    found = solve(seen, rig, body, spot_sigma_px(rig))
    return [
        MeasuredPoint(
            number=i + 1, feature=spheres[i % len(spheres)].name, time_s=float(i),
            first_frame=1000 * i, last_frame=1000 * i + _N_FRAMES - 1, n_frames=_N_FRAMES,
            tip_world=found.tip_world[i], random_covariance=1e-6 * np.eye(3), direction=normals[i],
            tip_radius=body.tip_radius, rotation_world_from_probe=np.eye(3), spots=seen[i],
            chi2_per_dof=1.0, approach="trail",
        )
        for i in range(count)
    ]  # fmt: skip


def write_large_job(
    folder: Path, points: int, features: int, after: Path | None = None
) -> tuple[Path, Path]:
    """Write a job in which all spheres are measured; return the files of its plan and of it."""
    plan = large_plan(points, features, after)
    file = folder / "large.toml"
    save_plan(plan, file)
    head = make_head(plan=file, rig=RIG, probe=PROBE, operator="me", part=plan.part, serial="1")
    path = folder / "large.ocmm"
    with JobFile.create(path, head) as job:
        made = large_points(plan)
        # As the station does, in steps: one of all points would exceed the time of a read.
        for start in range(0, len(made), _STEP):
            job.change(append=made[start : start + _STEP])
    return file, path


def _centres(features: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    k = np.arange(features)
    rows = -(-features // _COLUMNS)
    return np.stack(
        [
            _PITCH * (k % _COLUMNS - 0.5 * (_COLUMNS - 1)),
            _PITCH * (k // _COLUMNS - 0.5 * (rows - 1)),
            np.zeros(features),
        ],
        axis=1,
    )


def looked_at(plan: Plan, path: Path) -> tuple[float, float]:
    """Return the times of the first view and of one after one more point, s."""
    rig, body = load_rig(RIG), load_probe(PROBE)
    with JobFile.open(path) as job:
        stored = job.points()
        session = InspectionSession(plan, rig, body, job, SessionOptions())
        begun = time.process_time()
        results = session.view.characteristics
        first = time.process_time() - begun
        if any(result.uncertainty is None for result in results):
            raise SystemExit("A sphere has no uncertainty.")
        more = []
        for point in stored[:10]:
            session.points.delete_point(point.number, "Touched again.")
            _ = session.view
            session.points.restore_point(point.number)
            begun = time.process_time()
            _ = session.view
            more.append(time.process_time() - begun)
    return first, float(np.median(more))


def main() -> int:
    """Print the times; return 0 if all are within their limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--features", type=int, default=500)
    parser.add_argument("--report", action="store_true", help="write the PDF report as well")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ocmm-large-") as name:
        folder = Path(name)
        file, path = write_large_job(folder, options.points, options.features)
        opened = []
        for _ in range(2):
            begun = time.process_time()
            job = reopen_job(path, folder, calibrations=folder)
            opened.append(time.process_time() - begun)
        if job.doubts:
            raise SystemExit(job.doubts[0])
        if options.report:
            begun = time.process_time()
            with drawing():
                write_pdf(report_of_job(job), folder)
            sys.stdout.write(f"report {time.process_time() - begun:.2f} s\n")
        first, more = looked_at(load_plan(file), path)
    memory = limits.getrusage(limits.RUSAGE_SELF).ru_maxrss / 1024.0
    sys.stdout.write(
        f"{options.points} points, {options.features} features: opened {min(opened):.2f} s, "
        f"view {first:.2f} s, one more {1e3 * more:.1f} ms, {memory:.0f} MB\n"
    )
    good = min(opened) <= _OPENED_S and more <= _MORE_S and memory <= _MEMORY_MB
    return 0 if good or options.points != 10_000 else 1


if __name__ == "__main__":
    sys.exit(main())
