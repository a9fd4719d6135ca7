"""Which views of a board are still missing."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_boards import ViewCoach, calibrate_with_board
from ocmm_core.camera import on_sensor, project
from ocmm_core.geometry import Pixels, rotation_xyz
from tests.boards.board_scene import Scene, scene


def _shown(one: Scene, index: int, *, tilt: tuple[float, float], at: tuple[float, float]) -> Pixels:
    """Return the corners in a camera of a board 900 mm in front of it, tilted, at a place, mm."""
    camera = one.nominal.cameras[index]
    back = camera.T_camera_from_world.inverse()
    in_camera = one.board.corners @ rotation_xyz(*np.radians([*tilt, 0.0])).T + [*at, 900.0]
    seen = project(camera, back.apply(in_camera))
    return np.where(on_sensor(camera, seen)[:, None], seen, np.nan)


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return scene(tmp_path_factory.mktemp("coach"), 4)


def test_random_views_are_enough_when_they_determine_the_cameras(one: Scene) -> None:
    coach = ViewCoach(one.nominal.cameras, one.board)
    reports = [coach.add(list(view)) for view in one.views.uv]
    assert "Show the board to camera 'left'" in reports[0].wanted
    first = next((n for n, report in enumerate(reports, 1) if report.enough), 0)
    assert 0 < first <= len(reports)
    last = reports[-1]
    assert last.wanted == "There are enough views: calibrate."
    assert last.corners == tuple(np.isfinite(one.views.uv[-1, :, :, 0]).sum(axis=1))
    assert (last.cells > 0).all()
    assert last.cells.sum() == np.isfinite(one.views.uv[..., 0]).sum()
    found = calibrate_with_board(one.nominal, one.board, one.views.chosen(np.arange(first)))
    assert not [warning for warning in found.found.warnings if "few" in warning.code]


@pytest.mark.parametrize(
    ("tilt", "side"),
    [
        ((0.0, -35.0), "left"), ((0.0, 35.0), "right"), ((35.0, 0.0), "upper"),
        ((-35.0, 0.0), "lower"),
    ],
)  # fmt: skip
def test_the_edge_that_was_never_near_is_named(
    one: Scene, tilt: tuple[float, float], side: str
) -> None:
    # By the geometry: which edge of this tilted board is nearer to the camera.
    tilted = one.board.corners @ rotation_xyz(*np.radians([*tilt, 0.0])).T
    nearest = tilted[np.argmin(tilted[:, 2])]
    axis = 0 if side in ("left", "right") else 1
    assert (nearest[axis] > 0) == (side in ("right", "lower"))
    tilts = [(0.0, 35.0), (0.0, -35.0), (-35.0, 0.0), (35.0, 0.0)]
    tilts.remove(tilt)
    coach = ViewCoach(one.nominal.cameras, one.board)
    for each in tilts * 3:
        report = coach.add([_shown(one, index, tilt=each, at=(0.0, 0.0)) for index in (0, 1)])
    assert f"its {side} edge towards the camera" in report.wanted
    for _ in range(2):
        report = coach.add([_shown(one, index, tilt=tilt, at=(0.0, 0.0)) for index in (0, 1)])
    assert "edge towards the camera" not in report.wanted
    assert "of its picture" in report.wanted


def test_parts_of_the_picture_and_boards_that_nobody_sees(one: Scene) -> None:
    coach = ViewCoach(one.nominal.cameras, one.board)
    assert coach.report().views == 0
    unseen = np.full_like(one.views.uv[0], np.nan)
    report = coach.add(list(unseen))
    assert report.wanted.startswith("No camera sees enough of the board")
    assert (report.views, report.common, report.corners) == (0, 0, (0, 0))
    half = one.views.uv[:30].copy()
    half[:, 1] = np.nan
    for view in half:
        report = coach.add(list(view))
    assert report.wanted == "Show the board to camera 'right', and to another one as well."
    assert report.common == 0
