"""1,000 parts of a simulated lathe: no worse when stable, near nominal when it drifts or jumps."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_machine import CorrectionDocument, CorrectionLine, PartFacts, propose
from tests.host import amount
from tests.machine.cut_parts import document, line_of, measured, part
from tests.machine.machine_tool import Process, SimulatedLathe

SCATTER = 0.003
EXPANDED = 0.002
TOLERANCE = 0.03
COUNT = 1000
Plan = Callable[..., CorrectionDocument]


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    """Return a function that makes the document, with a dead band of 4.5 times the scatter."""

    def make(**more: object) -> CorrectionDocument:
        band = more.pop("dead_band", 4.5 * SCATTER)
        return document(
            tmp_path,
            [{"name": "T1 X", "kind": "turn-x", "number": 1, "counts": "diameter",
              "dead_band": band, "step": 0.2, "share": 1.0}],
            [{"characteristic": "size", "offsets": ["T1 X"], "acts": "outer"}],
            None, **more,
        )  # fmt: skip

    return make


def _run(
    plan: CorrectionDocument, process: Process, rng: np.random.Generator
) -> tuple[SimulatedLathe, int]:
    """Cut, measure and correct all parts; return the lathe and the number of corrections."""
    lathe = SimulatedLathe(process, COUNT, rng)
    # As many lines and parts as decide: the register of a shop would only be longer.
    lines: list[CorrectionLine] = []
    parts: list[PartFacts] = []
    for number, error in enumerate(lathe, 1):
        seen = error + float(rng.normal(0.0, 0.5 * EXPANDED))
        made = measured("size", "diameter", seen, EXPANDED, tolerance=TOLERANCE)
        parts = [*parts[-40:], part([made], number)]
        found = propose(plan, parts, lines)
        if found.changed:
            lines = [*lines[-2:], line_of(found, parts[-1].created + timedelta(seconds=1))]
            lathe.load(found.changed[0].after)
    return lathe, len(lines)


def _ratio(lathe: SimulatedLathe) -> float:
    """Return the variance of the parts over that without corrections."""
    return float(np.var(lathe.cut) / np.var(lathe.uncorrected))


def test_a_stable_process_is_left_alone(plan: Plan) -> None:
    """Rule 1 of Deming's funnel is not beaten: the ratio of the variances is at most 1.03."""
    ratios = [
        _ratio(lathe)
        for seed in range(amount(4, 20))
        for lathe, _ in [_run(plan(), Process(SCATTER), np.random.default_rng([46, seed]))]
    ]
    print(f"variance ratio of {len(ratios)} x {COUNT} parts: {np.mean(ratios):.4f}, "  # noqa: T201
          f"at most {max(ratios):.4f}")  # fmt: skip
    assert np.mean(ratios) <= 1.03


def test_a_dead_band_of_u_alone_makes_it_worse(plan: Plan) -> None:
    """The funnel does scatter more without the dead band: the test above can fail."""
    rng = np.random.default_rng(46)
    lathe, _ = _run(plan(dead_band=1e-4), Process(SCATTER), rng)
    assert _ratio(lathe) > 1.3


@pytest.mark.parametrize("method", ["last", "trend"])
@pytest.mark.parametrize("dead", [0, 2])
def test_a_drift_is_followed(method: str, dead: int, plan: Plan) -> None:
    """2 um a part: the mean error is at most a fifth of the uncorrected one."""
    asked = plan(method=method, parts=4 if method == "trend" else 1, dead_parts=dead)
    process = Process(SCATTER, wear=0.002, thermal=0.02, dead_parts=dead)
    for seed in range(amount(1, 5)):
        lathe, _ = _run(asked, process, np.random.default_rng([47, seed]))
        mean = float(np.mean(np.abs(lathe.cut)))
        print(f"drift, {method}, {dead} dead: {1e3 * mean:.2f} um, "  # noqa: T201
              f"uncorrected {1e3 * np.mean(np.abs(lathe.uncorrected)):.0f} um")  # fmt: skip
        assert mean <= 0.2 * np.mean(np.abs(lathe.uncorrected))
        # Far below that fifth: the dead band, the parts that are waited for, and the scatter.
        assert mean < 4.5 * SCATTER + 0.002 * (dead + 8)


def test_a_jump_is_in_tolerance_within_two_parts(plan: Plan) -> None:
    for seed in range(amount(2, 10)):
        jumps = ((200, 0.08), (500, -0.12), (800, 0.06))
        process = Process(0.5 * SCATTER, jumps=jumps)
        lathe, _ = _run(plan(), process, np.random.default_rng([48, seed]))
        for first, size in jumps:
            assert abs(lathe.cut[first]) > TOLERANCE
            after = np.abs(lathe.cut[first + 1 : first + 20])
            assert (after[1:] <= TOLERANCE).all(), (seed, size, after)


def test_parts_cut_before_the_operator_loaded_it_do_not_count(plan: Plan) -> None:
    """Otherwise the same error would be corrected twice."""
    process = Process(0.5 * SCATTER, jumps=((100, 0.08),), dead_parts=3)
    rng = np.random.default_rng(49)
    lathe, _ = _run(plan(dead_parts=3), process, rng)
    assert (np.abs(lathe.cut[104:130]) <= TOLERANCE).all()
    lathe, _ = _run(plan(dead_parts=0), process, np.random.default_rng(49))
    assert not (np.abs(lathe.cut[104:130]) <= TOLERANCE).all()
