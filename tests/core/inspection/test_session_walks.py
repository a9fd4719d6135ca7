"""Random walks of an inspector: verdicts always follow from the measured points."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import FeatureState, HoldReason, JobView
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.tolerances.decisions import PartWord, Verdict
from tests.core.inspection.conftest import Bench

WALKS, STEPS = 30, 25


@pytest.mark.parametrize("seed", range(WALKS))
def test_verdicts_follow_from_what_is_measured(bench: Bench, seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = [feature.name for feature in bench.plan.features]
    by_feature = {"BED": (0, 4), "BLOCK_TOP": (4, 8), "SPHERE": (8, 14)}
    with bench.job() as job:
        session = bench.session(job)
        for _ in range(int(rng.integers(0, 3)) * 7):
            _touch(session, bench, by_feature, rng)
        for _ in range(STEPS):
            name = str(rng.choice(names))
            before = session.view
            session.steps.select(name if rng.random() < 0.8 else "")
            _looked_back(before, session.view)
            verbs: list[Callable[[], object]] = [
                lambda: _touch(session, bench, by_feature, rng),
                lambda: _touch(session, bench, by_feature, rng),
                lambda: _touch(session, bench, by_feature, rng),
                session.steps.finish,
                partial(session.steps.skip, name),
                partial(session.steps.reopen, name),
                partial(session.steps.repeat, name),
                session.steps.undo,
                session.steps.redo,
                lambda: session.points.delete_point(int(rng.integers(1, 15)), "a chip"),
                lambda: session.points.restore_point(int(rng.integers(1, 15))),
                lambda: session.held.hold_back_points(
                    [int(rng.integers(1, 15))], "Why.", HoldReason.CAMERAS
                ),
                lambda: session.held.release("All is well."),
            ]
            with contextlib.suppress(MeasuringError):
                verbs[int(rng.integers(len(verbs)))]()
            _check(bench, session.view)
        told = session.view
        again = bench.session(job).view
        assert [item.verdict for item in again.characteristics] == [
            item.verdict for item in told.characteristics
        ]
        assert again.part_verdict == told.part_verdict
        assert [item.state for item in again.features] == [item.state for item in told.features]


def _touch(
    session: InspectionSession,
    bench: Bench,
    by_feature: dict[str, tuple[int, int]],
    rng: np.random.Generator,
) -> None:
    active = session.view.active
    if active:
        first, end = by_feature[active]
        session.touches.record_touch(bench.touches[int(rng.integers(first, end))])


def _looked_back(before: JobView, view: JobView) -> None:
    assert view.characteristics == before.characteristics
    assert view.part_verdict == before.part_verdict
    assert view.complete == before.complete
    done = [item.name for item in before.features if item.state is FeatureState.DONE]
    assert done == [item.name for item in view.features if item.state is FeatureState.DONE]


def _check(bench: Bench, view: JobView) -> None:
    state = {item.name: item.state for item in view.features}
    held = set(view.held)
    for item, result in zip(bench.plan.characteristics, view.characteristics, strict=True):
        below = bench.plan.rests_on(item)
        done = all(state[name] is FeatureState.DONE for name in below)
        open_ = any(state[name] in (FeatureState.ACTIVE, FeatureState.PENDING) for name in below)
        if result.verdict in (Verdict.CONFORM, Verdict.NOT_CONFORM):
            assert done
            assert not any(p.number in held for name in below for p in view.feature(name).points)
        assert result.verdict is not Verdict.PROVISIONAL or open_
        assert result.verdict is Verdict.NOT_MEASURED or result.measured is not None or open_
        assert result.stated is None or done
    part = view.part_verdict
    whole = all(one is FeatureState.DONE for one in state.values())
    assert part.complete <= whole
    assert (part.word is PartWord.CONFORMS) <= all(
        item.verdict is Verdict.CONFORM for item in view.characteristics
    )
    for feature in view.features:
        assert not feature.points or view.shown is not None
