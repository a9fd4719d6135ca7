"""Different meanings are distinguishable by everyone: by colour, or else by word and shape."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.kit import THEMES, verdict_mark
from ocmm_gui.kit._marks import status_mark
from tests.gui.colour_vision import MACHADO, ciede2000, lab, linear, seen

APART = 10.0
"""CIEDE2000 at which neighbouring colours differ at a glance; 1 is just visible."""
KINDS = ("usual", *MACHADO)
OUTCOMES = ("good", "warn", "bad")
ZONES = ("zone_good", "zone_warn", "zone_bad")


@pytest.mark.parametrize(
    ("first", "second", "difference"),
    [
        # From the table of 34 test pairs by Sharma, Wu and Dalal.
        ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
        ((50.0, 0.0, 0.0), (50.0, -1.0, 2.0), 2.3669),
        ((50.0, 2.5, 0.0), (50.0, 0.0, -2.5), 4.3065),
        ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
        ((50.0, 2.5, 0.0), (61.0, -5.0, 29.0), 22.8977),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
        ((22.7233, 20.0904, -46.6940), (23.0331, 14.9730, -42.5619), 2.0373),
        ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
    ],
)
def test_the_difference_is_ciede2000(
    first: tuple[float, ...], second: tuple[float, ...], difference: float
) -> None:
    # Published to four decimals.
    assert ciede2000(np.array(first), np.array(second)) == pytest.approx(difference, abs=6e-5)


def test_white_and_grey_are_seen_alike_by_everybody() -> None:
    for kind in MACHADO:
        for grey in ("#000000", "#808080", "#ffffff"):
            # Rows of the matrices sum to one, to their six decimals.
            assert seen(grey, kind) == pytest.approx(linear(grey), abs=5e-6)
    assert lab(linear("#ffffff")) == pytest.approx((100.0, 0.0, 0.0), abs=0.02)


def _difference(theme: str, first: str, second: str, kind: str) -> float:
    colours = THEMES[theme]
    a, b = (lab(seen(getattr(colours, name), kind)) for name in (first, second))
    return ciede2000(a, b)


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("names", [OUTCOMES, ZONES], ids=["outcomes", "zones"])
def test_outcomes_are_told_apart(theme: str, kind: str, names: tuple[str, ...]) -> None:
    for first, second in combinations(names, 2):
        found = _difference(theme, first, second, kind)
        assert found >= APART, f"{first} and {second}: {found:.1f}"


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("kind", KINDS)
def test_ready_and_measuring_are_told_apart(theme: str, kind: str) -> None:
    assert _difference(theme, "good", "accent", kind) >= APART


def test_every_verdict_and_status_has_a_shape_and_a_word_of_its_own() -> None:
    outcomes = (Verdict.CONFORM, Verdict.NOT_CONFORM, Verdict.NOT_PROVEN, Verdict.NOT_MEASURED)
    assert len({verdict_mark(verdict) for verdict in outcomes}) == len(outcomes)
    assert len({verdict.value for verdict in Verdict}) == len(Verdict)
    # Shapes say whether it can be measured; words say why not.
    ready, doubt, lost = (
        {status_mark(status) for status in group}
        for group in (
            (StatusWord.READY, StatusWord.MEASURING),
            (StatusWord.NOT_READY, StatusWord.INACCURATE),
            (StatusWord.LOST, StatusWord.FAILED),
        )
    )
    assert not ready & doubt
    assert not doubt & lost
    assert not ready & lost
