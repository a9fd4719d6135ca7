"""Studies of many real job files: each is opened, checked and computed once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import compare_files, compare_folder
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Touch, TouchCollector
from ocmm_core.processes import processes_for
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_shop.studies import StudyPlan, plan_study, study_jobs
from ocmm_sim.scene import VirtualRig, load_part
from tests.core.inspection.conftest import FRAME_RATE_HZ, PLAN, PROBE, RIG
from tests.host import amount

_SEEDS = 4
_PARTS = amount(5, 9)
"""Of six runs each; with five of them jobs are still read by processes side by side."""
_RUNS = 6 * _PARTS


def _touches(seed: int) -> tuple[Touch, ...]:
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, script, seed=seed, frame_rate_hz=FRAME_RATE_HZ)
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, SessionOptions().point)
    frames = virtual.frames(0, virtual.n_frames)
    return tuple(collector.push(TrackingPipeline(rig, body).process(frames)))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[StudyPlan, Path]:
    """Return the jobs of a study: touches of four virtual rigs, stored as they are measured."""
    plan = plan_study("GRR", [f"P{i}" for i in range(_PARTS)], ["Ann", "Bob", "Cid"], 2, 1)
    folder = tmp_path_factory.mktemp("many")
    touches = [_touches(seed) for seed in range(_SEEDS)]
    rig, body, measured = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    for number, run in enumerate(plan.runs):
        head = make_head(
            plan=PLAN, rig=RIG, probe=PROBE, operator=run.operator, part="P", serial=run.code
        )
        with JobFile.create(folder / f"{run.code}.ocmm", head) as job:
            session = InspectionSession(measured, rig, body, job, SessionOptions())
            for touch in touches[number % _SEEDS]:
                session.touches.record_touch(touch)
    return plan, folder


def test_a_study_of_many_jobs_counts_each_once(study: tuple[StudyPlan, Path]) -> None:
    plan, folder = study
    assert processes_for(_RUNS) == HOST.processors(), "they are read side by side"
    told: list[float] = []
    report = study_jobs(plan, folder, progress=lambda _what, share: told.append(share))
    assert (report.measured, report.left_out) == (_RUNS, ())
    assert all(one.study is not None for one in report.characteristics)
    # Every job is reported once, and the share only grows.
    assert told[-1] == 1.0
    assert told == sorted(told)
    assert len(set(told)) == _RUNS + 1


def test_how_they_are_read_changes_no_digit(study: tuple[StudyPlan, Path]) -> None:
    paths = sorted(study[1].glob("*.ocmm"))[:6]
    alone, beside = compare_files(paths, processes=1), compare_files(paths, processes=2)
    for one, other in zip(alone.trends, beside.trends, strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_who_cancels_is_heard_before_the_next_job(study: tuple[StudyPlan, Path]) -> None:
    heard: list[float] = []

    def cancel(_what: str, share: float) -> None:
        heard.append(share)
        if share > 0.1:
            raise OcmmError("cancelled", "Cancelled.", "")

    with pytest.raises(OcmmError, match="Cancelled"):
        compare_folder(study[1], cancel)
    assert max(heard) < 0.15
