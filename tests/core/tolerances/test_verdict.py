"""Verdicts joined: of a feature and of the part, over all combinations."""

from __future__ import annotations

from itertools import product

import pytest

from ocmm_core.tolerances.decisions import (
    NO_VERDICT,
    WORST_FIRST,
    CharacteristicResult,
    PartWord,
    RequirementCount,
    Verdict,
    judge_part,
    summarise,
)
from tests.generated_jobs import is_greener


def result(
    name: str, verdict: Verdict, features: tuple[str, ...] = ("BORE",), value: float | None = 1.0
) -> CharacteristicResult:
    return CharacteristicResult(
        name=name, kind="diameter", features=features, nominal=0.0, lower=-1.0, upper=1.0,
        measured=value, deviation=value, uncertainty=0.1, verdict=verdict,
    )  # fmt: skip


def test_the_order_is_complete_and_green_is_the_last() -> None:
    assert set(WORST_FIRST) == set(Verdict)
    assert [v for v in Verdict if is_greener(v, Verdict.PROVISIONAL)] == [Verdict.CONFORM]
    assert not any(is_greener(v, Verdict.CONFORM) for v in Verdict)


# 4 characteristics of 5 verdicts each and fewer: every combination there is, 780.
@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_nothing_is_greener_than_the_worst(count: int) -> None:
    for verdicts in product(Verdict, repeat=count):
        results = [result(f"c{i}", verdict) for i, verdict in enumerate(verdicts)]
        worst = min(verdicts, key=WORST_FIRST.index)
        summary = summarise(results, "BORE")
        assert summary.verdict is worst
        assert next(r for r in results if r.name == summary.deciding).verdict is worst
        assert dict(summary.counts) == {v: verdicts.count(v) for v in set(verdicts)}
        assert summary.total == count
        for missing in ((), ("SLOT",)):
            part = judge_part(results, missing)
            everything = set(verdicts) == {Verdict.CONFORM} and not missing
            assert (part.word is PartWord.CONFORMS) == everything
            assert (part.word is PartWord.DOES_NOT_CONFORM) == (Verdict.NOT_CONFORM in verdicts)
            assert part.verdict is not None
            assert not is_greener(part.verdict, worst)
            undecided = {Verdict.NOT_MEASURED, Verdict.PROVISIONAL} & set(verdicts)
            assert part.complete == (not missing and not undecided)
            assert part.complete == (not part.missing)


def test_the_worst_leads_and_the_others_are_counted() -> None:
    results = (
        result("Diameter", Verdict.CONFORM),
        result("X", Verdict.NOT_CONFORM),
        result("Form", Verdict.CONFORM),
    )
    summary = summarise(results, "BORE")
    assert (summary.deciding, summary.share) == ("X", "1 of 3 NOT CONFORM")
    assert summary.counted == "1 NOT CONFORM, 2 CONFORM"
    assert summarise(results[:1], "BORE").share == ""
    assert summarise((), "BORE") is NO_VERDICT


def test_among_equals_what_has_a_value_and_is_about_the_feature_alone_leads() -> None:
    far = result("Distance", Verdict.NOT_PROVEN, ("BORE", "FACE"))
    own = result("Diameter", Verdict.NOT_PROVEN)
    blind = result("Form", Verdict.NOT_PROVEN, value=None)
    assert summarise((blind, far, own), "BORE").deciding == "Diameter"
    assert summarise((blind, far), "BORE").deciding == "Distance"
    assert summarise((blind,), "BORE").deciding == "Form"
    assert summarise((far, own)).deciding == "Distance"


def test_the_part_says_what_fails_and_what_is_missing() -> None:
    part = judge_part(
        (
            result("Bore", Verdict.NOT_CONFORM),
            result("Step", Verdict.NOT_PROVEN),
            result("Slot width", Verdict.NOT_MEASURED, value=None),
            result("Flatness", Verdict.CONFORM),
        ),
        ("SLOT",),
    )
    assert part.word is PartWord.DOES_NOT_CONFORM
    assert part.missing == ("SLOT", "Slot width")
    assert part.reasons == (
        "NOT CONFORM: Bore",
        "NOT PROVEN: Step",
        "INCOMPLETE: SLOT",
        "NOT MEASURED: Slot width",
    )
    # A part without tolerances promises nothing, and one with features missing less.
    assert judge_part((), ()).word is PartWord.NO_TOLERANCE
    assert judge_part((), ("SLOT",)).word is PartWord.NOT_COMPLETE
    assert judge_part((), ()).verdict is None


@pytest.mark.parametrize("verdict", list(Verdict))
def test_the_word_of_a_part_is_said_once(verdict: Verdict) -> None:
    part = judge_part((result("Bore", verdict),), ("SLOT",))
    said = "; ".join(part.lines)
    assert said.startswith(part.word.value)
    assert said.count(f"{part.word.value}: ") + said.count(f"{part.word.value}; ") <= 1
    assert all(reason in said for reason in part.reasons)


def test_a_part_by_none_of_its_requirements_is_not_shown_as_good() -> None:
    """The large line has the count; with 0 of 52 it has neither colour nor sign of CONFORM."""
    for present in (0, 18, 52):
        part = judge_part(
            [result("a", Verdict.CONFORM)], (), RequirementCount(present, 52, 0, "model")
        )
        assert (part.word, part.verdict) == (PartWord.CONFORMS, Verdict.CONFORM)
        assert (part.shown_as is Verdict.CONFORM) == (present > 0)
        count = (f"{present} of 52 requirements",) if present < 52 else ()
        assert part.short_headline == ("PART CONFORMS", *count)
