"""Calibrate the cameras of a rig with pictures of a calibration board in unknown poses.

In: the document of a board, and its corners in simultaneous pictures of all cameras.
Out: cameras with full covariance, findings, and a camera record.

Read `_board` (the board and the covariance of its shape), `_corners` (tables of corners),
`_detection` (corners in pictures, by OpenCV), then `_solution` (one bundle of cameras, poses and
board shape) with `_guards` (first values before it, criteria after it). `_command` has `ocmm
calibrate boards` and `pictures`, entry points of `ocmm.commands`; nothing imports this package.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_boards._board import Board, load_board
    from ocmm_boards._command import calibrate_boards, take_pictures
    from ocmm_boards._corners import BoardViews, read_corners
    from ocmm_boards._detection import detect_corners
    from ocmm_boards._solution import BoardCalibration, calibrate_with_board
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Board", "BoardCalibration", "BoardViews", "calibrate_boards", "calibrate_with_board",
    "detect_corners", "load_board", "read_corners", "take_pictures",
]  # fmt: skip
