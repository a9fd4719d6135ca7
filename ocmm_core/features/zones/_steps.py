from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

Values = NDArray[Any]
"""float64, or complex128 for derivatives."""

STEP_SIZE = 8
FIRST_SIZE, SECOND_SIZE, TURN = 5, 6, 7
"""Entries of a step; the first ones are a shift (3) and a lean (2)."""
