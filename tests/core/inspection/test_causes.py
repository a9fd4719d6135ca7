"""The cause of a bad result, and its remedy: twenty jobs with one fault each.

Seeds are 0 to 19 and alternate between the causes; `benchmarks.causes` runs 200 more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.cause_scenes import SPOILED, Scene, asked, explained, is_right, make_job
from ocmm_core.inspection.causes import EXPLAINED, Cause, Explanation, explanations_of
from ocmm_core.inspection.causes._inquiry import amount_words, beyond_limit
from ocmm_core.tolerances.decisions import Verdict, not_measured
from ocmm_core.tolerances.zones import Characteristic

# For hangs only: the first job computes its sensitivities under any load.
pytestmark = pytest.mark.timeout(300)

WORDS = list(SPOILED)
LEAST_RIGHT = 0.9


@pytest.mark.statistics
def test_the_cause_is_named_in_at_least_18_of_20_jobs(
    record_property: Callable[[str, object], None], repeats: Callable[..., int]
) -> None:
    """In the short form in 9 of the first 10, which have every cause."""
    wrong = []
    jobs = repeats(10, 20)
    assert jobs >= len(WORDS)
    for seed in range(jobs):
        word = WORDS[seed % len(WORDS)]
        found, view, scene = explained(seed, SPOILED[word][0])
        # Every result that is NOT CONFORM or NOT PROVEN has an answer, and no other.
        assert [item.characteristic for item in found] == [
            item.name for item in view.characteristics if item.verdict in EXPLAINED
        ]
        for item in found:
            _check_is_sayable(item, scene)
        first = asked(view, found)
        if not is_right(word, first, scene):
            wrong.append(f"{seed} {word}: {first.suggestion if first else 'nothing'}")
    record_property("right", f"{jobs - len(wrong)} of {jobs}; wrong: {wrong}")
    assert jobs - len(wrong) >= LEAST_RIGHT * jobs, wrong


def _check_is_sayable(item: Explanation, scene: Scene) -> None:
    assert item.suggestion.endswith(".")
    assert item.why.endswith(".")
    assert len(item.suggestion) < 200
    assert len(item.points) <= 5
    assert set(item.points) <= {point.number for point in scene.station.points}
    names = {feature.name for feature in scene.plan.features}
    assert set(item.finding.features) <= names


@pytest.mark.parametrize("seed", range(3))
def test_a_good_job_needs_no_explanation(seed: int) -> None:
    job, view, _ = make_job(seed, None)
    assert {item.verdict for item in view.characteristics} == {Verdict.CONFORM}
    assert explanations_of(job, view) == ()


def test_the_points_of_an_outlier_are_those_that_were_moved() -> None:
    found, view, scene = explained(0, SPOILED["outlier"][0])
    first = asked(view, found)
    assert first is not None
    farthest = int(np.argmax(np.linalg.norm(scene.shifts, axis=1)))
    number = scene.station.points[farthest].number
    assert first.points == (number,)
    assert first.suggestion == f"Re-probe point {number} of {scene.wrong[0]}."


def test_the_tip_is_told_by_how_much_it_is_wrong() -> None:
    found, view, scene = explained(5, SPOILED["tip"][0])
    first = asked(view, found)
    assert first is not None
    outwards = [
        float(shift @ point.direction)
        for shift, point in zip(scene.shifts, scene.station.points, strict=True)
    ]
    # The features' own sizes scatter by 4 µm, and the words round to a micrometre.
    told = float(first.suggestion.split("about ")[1].split(" mm")[0])
    assert told == pytest.approx(2.0 * abs(float(np.mean(outwards))), abs=0.01)


def test_what_is_held_back_keeps_its_own_remedy() -> None:
    job, view, _ = make_job(9, SPOILED["part"][0])
    why = "The calibration is not verified. Verify it."
    doubted = replace(
        view,
        unproven=why,
        characteristics=tuple(
            replace(item, verdict=Verdict.NOT_PROVEN, note=why) for item in view.characteristics
        ),
    )
    found = explanations_of(job, doubted)
    assert len(found) == len(view.characteristics)
    assert {item.cause for item in found} == {Cause.DOUBT}
    assert {item.suggestion for item in found} == {why}
    assert not any(item.points for item in found)


def test_the_amount_is_told_beside_u() -> None:
    item = Characteristic(
        name="it", kind="diameter", features=["A"], nominal=20.0, lower=-0.05, upper=0.05
    )
    base = replace(not_measured(item, ""), uncertainty=0.01, unit="mm")

    def words(value: float, verdict: Verdict, u: float = 0.01) -> str:
        measured = replace(base, measured=value, verdict=verdict, uncertainty=u)
        return amount_words(item, measured)

    assert words(20.09, Verdict.NOT_CONFORM) == (
        "0.0400 mm beyond the upper limit 20.0500 mm; U is 0.0100 mm (4.0 times U)."
    )
    assert words(19.93, Verdict.NOT_CONFORM).startswith("0.0200 mm beyond the lower limit 19.9500")
    assert words(20.046, Verdict.NOT_PROVEN).endswith(
        "U would have to be below 0.0040 mm, or the value below 20.0400 mm."
    )
    assert "neither conformance nor non-conformance is proven" in words(20.055, Verdict.NOT_PROVEN)
    assert "only 0.1000 mm wide" in words(20.0, Verdict.NOT_PROVEN, u=0.06)
    inside = replace(base, measured=20.04)
    assert beyond_limit(item, inside) == pytest.approx(-0.01)
