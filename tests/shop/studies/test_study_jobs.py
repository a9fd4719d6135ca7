from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import OcmmError
from ocmm_shop.studies import (
    StudyPlan,
    load_study,
    open_runs,
    plan_study,
    plan_text,
    require_balanced,
    study_of,
)
from tests.shop.studies.study_site import jobs_of

_PARTS = [f"{one:02}" for one in range(1, 11)]


def _plan(seed: int = 1) -> StudyPlan:
    return plan_study("GRR", _PARTS, ["Ann", "Bob", "Cid"], 3, seed)


def test_a_plan_is_balanced_blind_and_drawn_anew_for_every_operator_and_trial(
    tmp_path: Path,
) -> None:
    plan = _plan()
    assert len(plan.runs) == 90
    require_balanced(plan, "plan")
    blocks = [plan.runs[i : i + 10] for i in range(0, 90, 10)]
    assert all(len({one.operator for one in block}) == 1 for block in blocks)
    assert len({tuple(one.part for one in block) for block in blocks}) == 9
    # The code reveals neither part nor operator nor order.
    codes = [int(one.code.split("-")[1]) for one in plan.runs]
    assert abs(np.corrcoef(codes, range(90))[0, 1]) < 0.3
    path = tmp_path / "study.toml"
    path.write_text(plan_text(plan), encoding="utf-8")
    assert load_study(path) == plan
    assert _plan(2) != plan == _plan(1)


def test_a_plan_that_is_not_balanced_is_refused() -> None:
    plan = _plan()
    with pytest.raises(OcmmError, match="is missing"):
        require_balanced(msgspec.structs.replace(plan, runs=plan.runs[1:]), "plan")
    twice = (*plan.runs[:-1], msgspec.structs.replace(plan.runs[-1], code=plan.runs[0].code))
    with pytest.raises(OcmmError, match="there twice"):
        require_balanced(msgspec.structs.replace(plan, runs=twice), "plan")
    with pytest.raises(OcmmError, match="control character"):
        plan_study('A"\n[x]', _PARTS, ["A", "B"], 2, 1)


def test_every_characteristic_of_jobs_is_a_study() -> None:
    plan = _plan()
    report = study_of(plan, jobs_of(plan))
    (one,) = report.characteristics
    assert report.measured == 90
    assert one.study is not None
    assert one.study.ev == pytest.approx(0.003, rel=0.25)
    assert one.study.tolerance_percent == pytest.approx(600 * one.study.grr / 0.4)
    assert one.stated is not None
    assert one.stated.message == ""
    assert one.from_study is not None
    assert one.from_study.q_ms == pytest.approx(400 * one.study.ev / 0.4)
    assert one.from_budget is not None
    assert one.from_budget.q_ms == pytest.approx(400 * 0.003 / 0.4)


def test_a_stated_uncertainty_below_the_scatter_is_told() -> None:
    plan = _plan()
    (one,) = study_of(plan, jobs_of(plan, factor=3.0)).characteristics
    assert one.stated is not None
    assert "too small" in one.stated.message


def test_nothing_is_filled_up() -> None:
    plan = _plan()
    jobs = jobs_of(plan)
    (trend,) = jobs.trends
    holed = replace(trend, parts=trend.parts[:-1])
    (one,) = study_of(plan, replace(jobs, trends=(holed,))).characteristics
    assert one.study is None
    assert "1 of 90 values of this characteristic are missing" in one.why_not
    assert [run.code for run in open_runs(plan, {p.serial for p in holed.parts})] == [
        plan.runs[-1].code
    ]
    double = replace(trend, parts=(*trend.parts, trend.parts[0]))
    (one,) = study_of(plan, replace(jobs, trends=(double,))).characteristics
    assert "measured twice" in one.why_not
