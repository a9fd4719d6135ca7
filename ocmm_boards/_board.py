"""Calibration boards: a grid of corners, markers or dots, with the covariance of its shape.

::

    schema = "ocmm.board/1"
    unit = "mm"
    name = "glass 12 x 9"
    serial = "CB-12"
    pattern = "chessboard"
    columns = 11
    rows = 8
    pitch = 30.0
    expanded = 0.01
    corner_sigma = 0.003
    flatness = 0.05
    expansion = 8.5e-6
    expansion_sigma = 1.0e-6

The shape errs by a common scale (``expanded``, k = 2, of the diagonal), by a bend and twist of up
to ``flatness``, and by each corner on its own (``corner_sigma``). All three are unknowns of the
calibration. Without a ``certificate`` the scale is not traceable, however small ``expanded`` is.

Patterns: ``chessboard``; ``charuco`` (with ``dictionary`` and ``marker``); ``apriltag``, markers in
rows whose four corners count (with ``dictionary``, ``marker``, and ``border`` in bits: 2 for the
grids of Kalibr); ``dots``, rows of dots of diameter ``dot``, every other row shifted by ``pitch``,
which is the distance of the rows and half of that of dots in a row.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Artefact, ArtefactCertificate, ArtefactHead, artefact_of
from ocmm_core.documents import load_with_text
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Points3

BOARD_SCHEMA = "ocmm.board/1"
FEWEST, MOST = 3, 60
"""Corners, markers or dots along one side. Cost grows with the square of their number."""
MOST_CORNERS = 400
LONGEST_PITCH_MM = 500.0

Pattern = Literal["chessboard", "charuco", "apriltag", "dots"]
MARKER_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""In sides of a marker, clockwise as seen from the front: x to the right, y down."""


class BoardDocument(ArtefactHead, frozen=True, kw_only=True):
    pattern: Pattern
    columns: int
    rows: int
    """`columns`, `rows`: Inner corners, markers or dots along x and y."""
    pitch: float
    """Distance of neighbouring corners, markers or rows of dots at 20 degrees, mm."""
    corner_sigma: float
    """Standard deviation of a corner's place in the grid, mm per axis."""
    flatness: float
    """Largest bend expected (k = 2), mm."""
    dictionary: str = ""
    marker: float = 0.0
    """`dictionary`, `marker`: Of boards with markers: OpenCV's name, and side of a marker, mm."""
    border: int = 1
    """Width of the black border of a marker, bits."""
    dot: float = 0.0
    """Diameter of a dot, mm."""
    certificate: ArtefactCertificate | None = None


@dataclass(frozen=True, slots=True)
class Board:
    """A board at the temperature of its pictures."""

    document: BoardDocument
    corners: Points3
    """(N, 3), mm, board frame: row by row, x along a row."""
    covariance: Float
    """(3 N, 3 N), mm^2, of all coordinates."""
    scale_sigma: float
    """Relative standard uncertainty of all distances."""
    artefact: Artefact
    """With its certificate, or with one of no number."""

    @property
    def traceable(self) -> bool:
        """Return whether its scale rests on a certificate."""
        return self.document.certificate is not None


def load_board(path: Path | str, temperature: Temperature | None = None) -> Board:
    """Return the board of a document at a temperature; InputError if malformed."""
    document, text = load_with_text(path, BoardDocument, BOARD_SCHEMA)
    for field in ("columns", "rows"):
        if not FEWEST <= getattr(document, field) <= MOST:
            raise _wrong(path, field, f"Give {FEWEST} to {MOST}.")
    corners = _grid(document)
    if len(corners) > MOST_CORNERS:
        raise _wrong(path, "rows", f"Use a board of at most {MOST_CORNERS} corners.")
    if not 0.0 < document.pitch <= LONGEST_PITCH_MM:
        raise _wrong(path, "pitch", "Give the distance of neighbouring corners in mm.")
    for field in ("corner_sigma", "flatness"):
        if not 0.0 < getattr(document, field) <= document.pitch:
            raise _wrong(path, field, "Give its uncertainty in mm; it is never zero.")
    if document.pattern in ("charuco", "apriltag") and not 0.0 < document.marker < document.pitch:
        raise _wrong(path, "marker", "Give the side of a marker in mm; it is below the pitch.")
    if document.pattern == "dots" and not 0.0 < document.dot < document.pitch:
        raise _wrong(path, "dot", "Give the diameter of a dot in mm; it is below the pitch.")
    if document.pattern == "dots" and document.rows % 2 == 0:
        raise _wrong(path, "rows", "With an even number of rows it looks the same upside down.")
    artefact = artefact_of(path, document, document.certificate, text)
    diagonal = float(np.linalg.norm(np.ptp(corners, axis=0)))
    length, expanded = artefact.at(diagonal, temperature)
    scale_sigma = 0.5 * expanded / diagonal
    if not scale_sigma > 0.0:
        raise _wrong(path, "expanded", "State its uncertainty (k = 2); it is never zero.")
    corners *= length / diagonal
    covariance = _shape_covariance(document, corners, scale_sigma)
    return Board(document, corners, covariance, scale_sigma, artefact)


def _grid(document: BoardDocument) -> Points3:
    """Return the nominal corners (N, 3), mm, about their mean."""
    y, x = (one.ravel() for one in np.indices((document.rows, document.columns)))
    if document.pattern == "dots":
        x = 2 * x + y % 2
    corners: Points3 = document.pitch * np.stack([x, y, 0.0 * x], axis=1)
    if document.pattern == "apriltag":
        about = np.column_stack([document.marker * MARKER_CORNERS, np.zeros(4)])
        corners = (corners[:, None] + about).reshape(-1, 3)
    centred: Points3 = corners - corners.mean(axis=0)
    return centred


def _shape_covariance(document: BoardDocument, corners: Points3, scale_sigma: float) -> Float:
    """Return the covariance of scale, bend and single corners, (3 N, 3 N), mm^2."""
    covariance = document.corner_sigma**2 * np.eye(corners.size)
    x, y = (corners[:, axis] / np.abs(corners[:, axis]).max() for axis in range(2))
    # A bend along x, one along y, and a twist, each of this height from the middle to an edge.
    for height in (1.0 - x * x, 1.0 - y * y, x * y):
        shape = np.zeros_like(corners)
        shape[:, 2] = 0.5 * document.flatness * height
        covariance += np.outer(shape.ravel(), shape.ravel())
    stretch = scale_sigma * corners.ravel()
    covariance += np.outer(stretch, stretch)
    # A print may be stretched more along one of its axes: half of the scale's uncertainty.
    skewed = 0.5 * scale_sigma * (corners * np.array([1.0, -1.0, 0.0])).ravel()
    covariance += np.outer(skewed, skewed)
    return covariance


def _wrong(path: Path | str, field: str, remedy: str) -> InputError:
    return InputError("board.field", f"{path}: field '{field}' is not usable.", remedy)
