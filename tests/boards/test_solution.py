"""Cameras calibrated with a board alone: their lengths lie within U, and lies are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_boards import BoardCalibration, BoardViews, calibrate_with_board
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from tests.boards.board_scene import Scene, length_errors, scene
from tests.host import looser


def _rig(one: Scene, found: BoardCalibration) -> Rig:
    return replace(
        one.nominal, cameras=found.found.cameras, parameter_covariance=found.found.covariance
    )


def _calibrated(one: Scene, views: BoardViews | None = None) -> BoardCalibration:
    return calibrate_with_board(one.nominal, one.board, views or one.views)


@pytest.mark.statistics
def test_lengths_lie_within_u(tmp_path: Path, repeats: Callable[..., int]) -> None:
    """Lengths of one rig err together: the share scatters with the number of rigs."""
    runs = repeats(4, 40)
    ratios = []
    for seed in range(runs):
        one = scene(tmp_path, seed, noise_px=0.05, views=50)
        errors, sigmas = length_errors(_rig(one, _calibrated(one)), one.true, seed)
        ratios.append(errors / sigmas)
    everything = np.concatenate(ratios)
    assert np.mean(np.abs(everything) <= 2.0) >= 1.0 - looser(0.08, runs, 40)
    rms = np.sqrt(np.mean(everything**2))
    assert abs(rms - 1.0) <= looser(0.25, runs, 40)


def test_the_scatter_of_corners_is_found(tmp_path: Path) -> None:
    one = scene(tmp_path, 3, noise_px=0.06, views=50)
    found = _calibrated(one)
    assert found.sigma_px == pytest.approx(0.06, rel=0.05)
    assert found.together < 1.3
    # Every fifth view is kept back, and its corners are located as well as they scatter.
    assert len(found.found.errors_world) > 500


def test_corners_that_err_together_widen_u(tmp_path: Path) -> None:
    alone = _calibrated(scene(tmp_path, 4, noise_px=0.03))
    together = _calibrated(scene(tmp_path, 4, noise_px=0.03, common_px=0.02))
    assert together.together > 1.5 * alone.together


def test_large_dots_count_by_their_centres(tmp_path: Path) -> None:
    """Tilt and lens move a dot of 24 mm by up to a pixel; the cameras are those of small dots."""
    errors, sigmas = [], []
    for dot in (24.0, 0.1):
        one = scene(tmp_path, 33, dot=dot)
        found = _calibrated(one)
        errors.append(length_errors(_rig(one, found), one.true, 33)[0])
        sigmas.append(found.sigma_px)
    assert sigmas[0] == pytest.approx(0.03, rel=0.1)
    assert np.abs(errors[0] - errors[1]).max() < 1e-3
    # The residuals do not show it.
    large = scene(tmp_path, 33, dot=24.0)
    small = replace(one.board, document=msgspec.structs.replace(one.board.document, dot=0.1))
    wrong = calibrate_with_board(one.nominal, small, large.views)
    assert wrong.sigma_px == pytest.approx(0.03, rel=0.1)
    assert np.abs(length_errors(_rig(one, wrong), one.true, 33)[0]).max() > 0.02


def test_a_bend_within_its_flatness_is_found(tmp_path: Path) -> None:
    one = scene(tmp_path, 5, bent_mm=0.15)
    found = _calibrated(one)
    middle = found.corners - found.corners.mean(axis=0)
    true = one.shape - one.shape.mean(axis=0)
    assert np.abs(middle[:, 2] - true[:, 2]).max() < 0.03


def test_the_scale_of_a_board_without_certificate_is_not_traceable(tmp_path: Path) -> None:
    found = _calibrated(scene(tmp_path, 6))
    (said,) = [one for one in found.found.warnings if one.code == "boards.scale"]
    assert "not traceable" in said.what


def test_u_holds_the_stated_scale(tmp_path: Path) -> None:
    """Scale dominates: a board certified to 1 mm of its diagonal (k = 2)."""
    one = scene(tmp_path, 7, expanded=1.0)
    errors, sigmas = length_errors(_rig(one, _calibrated(one)), one.true, 7)
    # Half as much again for an axis that is stretched on its own.
    assert 0.99 <= np.median(sigmas) / (one.board.scale_sigma * 300.0) <= 1.6
    assert np.mean(np.abs(errors) <= 2.5 * sigmas) > 0.95


def test_a_board_that_is_bent_more_than_stated_is_named(tmp_path: Path) -> None:
    one = scene(tmp_path, 30, bent_mm=1.5)
    with pytest.raises(CalibrationError, match="is not as its document says"):
        _calibrated(one)


def test_wrong_corners_are_left_out(tmp_path: Path) -> None:
    one = scene(tmp_path, 32)
    uv = one.views.uv.copy()
    good = np.argwhere(np.isfinite(uv[..., 0]))
    wrong = good[np.random.default_rng(1).choice(len(good), 20, replace=False)]
    uv[tuple(wrong.T)] += 5.0
    found = _calibrated(one, replace(one.views, uv=uv))
    clean = _calibrated(one)
    assert len(found.found.outliers) >= 15
    for a, b in zip(found.found.cameras, clean.found.cameras, strict=True):
        assert a.focal == pytest.approx(b.focal, rel=1e-4)


@pytest.mark.parametrize("count", [4, 7])
def test_few_views_are_refused(tmp_path: Path, count: int) -> None:
    with pytest.raises(CalibrationError) as refused:
        _calibrated(scene(tmp_path, 33, views=count))
    assert refused.value.code == "boards.few_views"


def test_cameras_without_a_common_view_are_refused(tmp_path: Path) -> None:
    one = scene(tmp_path, 34)
    uv = one.views.uv.copy()
    uv[::2, 0] = np.nan
    uv[1::2, 1] = np.nan
    with pytest.raises(CalibrationError) as refused:
        _calibrated(one, replace(one.views, uv=uv))
    assert refused.value.code == "boards.few_common"
