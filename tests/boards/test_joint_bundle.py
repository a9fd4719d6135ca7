"""Board, probe and bar in one bundle: lengths within U, and a traceable scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_boards import BoardCalibration, calibrate_with_board
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from tests.boards.board_scene import Scene, length_errors, recorded, scene
from tests.host import looser

UNCERTAIN_MM = 0.05
"""U of a printed board's diagonal without certificate: 140 um/m."""


def _rig(one: Scene, found: BoardCalibration) -> Rig:
    return replace(
        one.nominal, cameras=found.found.cameras, parameter_covariance=found.found.covariance
    )


def _errors(one: Scene, found: BoardCalibration, seed: int) -> tuple[Float, Float]:
    return length_errors(_rig(one, found), one.true, seed)


@pytest.mark.statistics
@pytest.mark.parametrize("poses", [120, 0])
def test_lengths_lie_within_u_and_are_better_than_by_the_board(
    tmp_path: Path, repeats: Callable[..., int], poses: int
) -> None:
    """Lengths of a rig err together; the bar alone repairs the scale of a board (``poses`` 0)."""
    runs = repeats(1, 40)
    ratios, better = [], 0
    for seed in range(100, 100 + runs):
        one = scene(tmp_path, seed, noise_px=0.05, expanded=UNCERTAIN_MM, small=True)
        spots = recorded(one, seed, poses=poses)
        found = calibrate_with_board(one.nominal, one.board, one.views, True, spots)
        assert not [said for said in found.found.warnings if said.code == "boards.scale"]
        # Few corners do not always determine the focal length within 1e-4.
        alone = calibrate_with_board(one.nominal, one.board, one.views, True)
        errors, sigmas = _errors(one, found, seed)
        before, stated = _errors(one, alone, seed)
        assert np.mean(sigmas) < 0.4 * np.mean(stated)
        ratios.append(errors / sigmas)
        better += bool(np.mean(errors**2) < np.mean(before**2))
    everything = np.concatenate(ratios)
    assert np.mean(np.abs(everything) <= 2.0) >= 1.0 - looser(0.08, runs, 40)
    assert abs(np.sqrt(np.mean(everything**2)) - 1.0) <= looser(0.2, runs, 40)
    # The size of the board is right by chance now and then: in 1 of 30 rigs it was better alone.
    assert better >= 0.8 * runs - 1


def test_a_bar_without_certificate_leaves_the_scale_untraceable(tmp_path: Path) -> None:
    one = scene(tmp_path, 6, small=True)
    spots = recorded(one, 6, poses=30, certified=False)
    found = calibrate_with_board(one.nominal, one.board, one.views, recorded=spots)
    assert "boards.scale" in {said.code for said in found.found.warnings}


def test_a_print_of_another_size_is_corrected_by_the_bar(tmp_path: Path) -> None:
    """Stated as uncertain as it is, the size of the print does not matter."""
    one = scene(tmp_path, 8, expanded=2.0, small=True)
    printed = replace(one.board, corners=one.board.corners / 0.996)
    spots = recorded(one, 8)
    found = calibrate_with_board(one.nominal, printed, one.views, recorded=spots)
    errors, sigmas = _errors(one, found, 8)
    assert np.mean(np.abs(errors) <= 2.5 * sigmas) > 0.9
    assert np.mean(sigmas) < 0.003
