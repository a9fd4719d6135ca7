"""The watch puts spots that know nothing of each other into groups; here they are not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from ocmm_core.calibration.monitor import ResidualAccumulator, ResidualSample
from ocmm_core.calibration.monitor import _drift_statistic as statistic
from ocmm_core.calibration.monitor._drift_design_matrix import Belief, SpotRows
from ocmm_core.calibration.monitor._drift_statistic import Scores, score_changes
from ocmm_core.calibration.monitor._spot_groups import independent_groups
from ocmm_core.geometry import Int
from tests.core.calibration.monitored import Monitored

FLOOR_PX = 0.0004


def numbers(scores: Scores) -> list[float]:
    every = [*scores.cameras, *scores.motions, *scores.lenses, *scores.leds]
    return [scores.chi2, *(one.score for one in every), *scores.axes.ravel().tolist()]


@pytest.fixture(scope="module")
def bench() -> Monitored:
    return Monitored.of()


@pytest.fixture(scope="module")
def looks(bench: Monitored) -> Sequence[ResidualSample]:
    track = bench.probing(0.0, 4.0)
    return ResidualAccumulator(bench.rig, bench.body, 50_000_000).feed(track)[:40]


def test_groups_say_what_all_spots_together_say(
    bench: Monitored, looks: Sequence[ResidualSample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same covariance of all spots of a camera at once is the reference."""

    def together(spots: SpotRows, _: float) -> list[Int]:
        return [np.arange(len(spots.led))]

    belief = Belief.of_documents(bench.rig, bench.body)
    sizes: list[int] = []
    groups = independent_groups

    def watched(spots: SpotRows, reach_px: float) -> list[Int]:
        found = groups(spots, reach_px)
        sizes.extend(len(group) for group in found)
        # Every spot is in one group, and in one only.
        assert sorted(np.concatenate(found).tolist()) == list(range(len(spots.led)))
        return found

    monkeypatch.setattr(statistic, "independent_groups", watched)
    grouped = score_changes(looks, bench.rig, bench.body, belief, FLOOR_PX)
    monkeypatch.setattr(
        statistic, "independent_groups", lambda spots, _: [np.arange(len(spots.led))]
    )
    dense = score_changes(looks, bench.rig, bench.body, belief, FLOOR_PX)
    assert len(looks) == 40
    assert len(sizes) > len(bench.rig.cameras)
    # What is left out is 1e-8 of the white noise (`REACH_LENGTHS`); rounding of a system whose
    # columns differ by a thousand, each side of it, comes to as much.
    assert numbers(grouped) == pytest.approx(numbers(dense), rel=1e-5, abs=1e-5)


def test_leds_whose_spots_come_near_are_one_group(bench: Monitored) -> None:
    none, two = np.zeros(0), np.zeros(2)
    uv = np.array([[10.0, 10.0], [400.0, 10.0], [150.0, 10.0], [400.0, 300.0]])
    spots = SpotRows(
        look=np.arange(4), led=np.array([0, 1, 2, 1]), uv=uv, residuals=uv, white_px=none,
        pattern_px=none, by_pose=two, by_camera=two, by_led=two,
    )  # fmt: skip
    assert [g.tolist() for g in independent_groups(spots, 160.0)] == [[0, 2], [1, 3]]
    assert [g.tolist() for g in independent_groups(spots, 100.0)] == [[0], [1, 3], [2]]
    assert [g.tolist() for g in independent_groups(spots, 260.0)] == [[0, 1, 2, 3]]
