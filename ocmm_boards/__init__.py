"""Calibrate the cameras of a rig with pictures of a calibration board in unknown poses.

In: the document of a board, and its corners in simultaneous pictures of all cameras; recordings of
a probe and of length bars. Out: cameras with full covariance, findings, and a camera record.

Read `_board` (the board and the covariance of its shape), `_corners` (tables of corners),
`_detection` (corners in pictures, by OpenCV; pictures as files), `_adjustment` (cameras, poses and
board shape) with `_guards` (first values before it, criteria after it), `_recordings` and `_joint`
(probe and bars in the same bundle), `_solution` (covariance, findings), `_session` (corners kept,
then the record) and `_coach` (views still missing). Commands and window call it; it must not know
them.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_boards._board import Board, load_board
    from ocmm_boards._coach import ViewCoach, ViewReport
    from ocmm_boards._corners import BoardViews, read_corners
    from ocmm_boards._detection import (
        corner_finder, detect_corners, genicam_source, next_view, views_in, write_view,
    )  # fmt: skip
    from ocmm_boards._joint import RecordedSpots
    from ocmm_boards._recordings import Recordings
    from ocmm_boards._session import BoardSession, kept_views, run_folder, run_session
    from ocmm_boards._solution import BoardCalibration, calibrate_with_board
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Board", "BoardCalibration", "BoardSession", "BoardViews", "RecordedSpots", "Recordings",
    "ViewCoach", "ViewReport", "calibrate_with_board", "corner_finder", "detect_corners",
    "genicam_source", "kept_views", "load_board", "next_view", "read_corners", "run_folder",
    "run_session", "views_in", "write_view",
]  # fmt: skip
