from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import (
    N_PARAMETERS,
    CalibrationDesign,
    CameraModel,
    known_points_covariance,
    load_rig,
    on_sensor,
    project,
    projection_jacobians,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Pixels, Points3

RIGS = ("thesis", "recommended")


def text_of(name: str) -> str:
    return resource("rigs", f"{name}.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", RIGS)
def test_covariance_is_positive_definite_and_separate_for_each_camera(name: str) -> None:
    rig = load_rig(resource("rigs", f"{name}.toml"))
    covariance = rig.parameter_covariance
    assert covariance.shape == (28, 28)
    assert np.array_equal(covariance, covariance.T)
    scale = np.sqrt(np.diag(covariance))
    # Units range from 1e-10 mm^-4 to 1 px, so the correlations are checked.
    assert np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() > 1e-12
    assert not covariance[:14, 14:].any()


def test_a_deep_calibration_knows_the_focal_length_better() -> None:
    focal = 6
    flat, deep = (
        np.sqrt(load_rig(resource("rigs", f"{name}.toml")).parameter_covariance[focal, focal])
        for name in RIGS
    )
    # Facts 1b: 13 um with a 15 mm slab and 1.1 um with 200 mm, both for 200 points; here 400.
    assert flat == pytest.approx(13e-3 / np.sqrt(2.0), rel=0.3)
    assert deep == pytest.approx(1.1e-3 / np.sqrt(2.0), rel=0.3)


def recalibrated(camera: CameraModel, believed: Points3, uv: Pixels) -> CameraModel:
    """Return the camera that explains ``uv`` best (least squares from the true start)."""
    for _ in range(4):
        _, d_parameters = projection_jacobians(camera, believed)
        rows = d_parameters.reshape(-1, N_PARAMETERS)
        scale = np.linalg.norm(rows, axis=0)
        miss = (uv - project(camera, believed)).ravel()
        camera = camera.perturbed(np.linalg.lstsq(rows / scale, miss)[0] / scale)
    return camera


def difference(found: CameraModel, true: CameraModel) -> Float:
    """Return found minus true in the order of `PARAMETERS`."""
    turn = found.T_camera_from_world.rotation @ true.T_camera_from_world.rotation.T
    names = ("focal", "aspect", "u0", "v0", "k1", "k2", "p1", "p2")
    return np.concatenate(
        [
            [turn[2, 1], turn[0, 2], turn[1, 0]],
            found.T_camera_from_world.translation - true.T_camera_from_world.translation,
            [getattr(found, name) - getattr(true, name) for name in names],
        ]
    )


@pytest.mark.parametrize("reference_sigma", [0.0, 0.003])
def test_covariance_is_that_of_recalibrated_cameras(reference_sigma: float) -> None:
    camera = load_rig(resource("rigs", "recommended.toml")).cameras[0]
    design = CalibrationDesign(
        method="known points",
        points=300,
        volume_min=(-200.0, -100.0, -200.0),
        volume_max=(200.0, 100.0, 200.0),
        spot_sigma_px=0.0105,
        reference_sigma=reference_sigma,
    )
    covariance = known_points_covariance(Path("rig.toml"), camera, design)
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    rng = np.random.default_rng(5)
    runs = 150
    squares = np.empty(runs)
    for run in range(runs):
        believed = rng.uniform(design.volume_min, design.volume_max, (design.points, 3))
        true = believed + reference_sigma * rng.standard_normal(believed.shape)
        uv = project(camera, true)
        assert on_sensor(camera, uv).all()
        uv = uv + design.spot_sigma_px * rng.standard_normal(uv.shape)
        error = difference(recalibrated(camera, believed, uv), camera) / scale
        squares[run] = error @ np.linalg.solve(correlation, error)
    # 14 expected; the mean of 150 runs scatters by sqrt(28 / 150) = 0.43. The design's own draw of
    # points, and one variance for all of them, add a few per cent: 14 +- 1.8 is four sigmas.
    assert squares.mean() == pytest.approx(14.0, abs=1.8)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('name = "right"', 'name = "left"', "name 'left'"),
        ("serial = 20600002", "serial = 20600001", "serial 20600001"),
        ("alias = 12", "alias = 11", "alias 11"),
    ],
)
def test_a_camera_named_twice_is_refused(tmp_path: Path, old: str, new: str, named: str) -> None:
    text = text_of("recommended")
    assert old in text
    path = tmp_path / "twice.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert caught.value.code == "rig.duplicate"
    assert named in caught.value.what


@pytest.mark.parametrize(
    ("depth", "points", "reason"),
    [("0.0", "400", "too flat"), ("1.0", "400", "too flat"), ("7.5", "6", "calibration points")],
)
def test_a_calibration_that_determines_nothing_is_refused(
    tmp_path: Path, depth: str, points: str, reason: str
) -> None:
    text = text_of("thesis").replace("-7.5", f"-{depth}").replace(" 7.5", f" {depth}")
    path = tmp_path / "flat.toml"
    path.write_text(text.replace("points = 400", f"points = {points}"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert caught.value.code == "rig.calibration"
    assert reason in caught.value.what
