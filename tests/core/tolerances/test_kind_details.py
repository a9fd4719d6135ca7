"""Words, places and signs of kinds of characteristics, and the end that decides."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.kinds import KINDS, evaluate
from ocmm_core.tolerances.zones import Frames
from tests.core.tolerances.known_part import KnownPart, asked, motion, ring


def test_the_end_that_is_off_the_most_decides_however_far_it_is_along_the_datum() -> None:
    part = KnownPart()
    part.add("pin", Shape.CYLINDER, ring(motion(0, 0, 0), 10.0, (-5, 0, 5)), diameter=20.0)
    # Its axis is 0.2 mm off at the pin and 0.05 mm off a hundred further on.
    off = motion(0.125, 0, 50, 0, -np.arctan(0.15 / 100.0), 0)
    part.add("neck", Shape.CYLINDER, ring(off, 7.0, (-50, 0, 50)), diameter=14.0, length=100.0)
    actual = part.actual()
    found = evaluate(asked("coaxiality", "neck", "pin"), actual, None, Frames(actual, None))
    assert found.value == pytest.approx(0.4, abs=1e-5)


@pytest.mark.parametrize("association", ["inscribed", "circumscribed", "minimum zone"])
def test_a_size_says_how_it_was_found(association: str) -> None:
    part = KnownPart()
    part.add("oval", Shape.CIRCLE, ring(motion(0, 0, 0), 10.0), diameter=20.0)
    actual = part.actual()
    item = asked("diameter", "oval", association=association)
    words = evaluate(item, actual, None, Frames(actual, None)).association
    assert words.startswith(f"{association} (G")


def test_only_a_coordinate_is_a_place_that_a_drawing_gives() -> None:
    assert {name for name, spec in KINDS.items() if spec.is_place} == {"coordinate"}


def test_total_runout_has_two_of_the_arrows_of_circular_runout_on_one_foot() -> None:
    one, two = (KINDS[f"{kind} runout"].symbol for kind in ("circular", "total"))
    assert one is not None
    assert two is not None
    shaft, head = one.lines
    assert len(two.lines) == 5
    for arrow, shift in ((two.lines[:2], -0.2), (two.lines[2:4], 0.2)):
        for found, wanted in zip(arrow, (shaft, head), strict=True):
            np.testing.assert_allclose(found, np.add(wanted, (shift, 0.0)), atol=1e-12)
    feet = [arrow[0] for arrow in (two.lines[0], two.lines[2])]
    np.testing.assert_allclose(two.lines[4], feet, atol=1e-12)
