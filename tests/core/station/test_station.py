"""The station with its threads: frames in, points and snapshots out, and a bounded end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.study import run_for
from ocmm_cli.terminal import make_console
from ocmm_core.acquisition.frames import AcquisitionState
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_sim.scene import ScriptedOcclusion, WorldOptions
from tests.host import BUSY, HANG_S
from tests.waiting import wait_until

ALL_LEDS = (0, 1, 2, 3, 4, 5)


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Callable[..., BuiltStation]]:
    built: list[BuiltStation] = []

    def make(**changes: object) -> BuiltStation:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path,
            frame_rate_hz=500,
            **changes,  # type: ignore[arg-type] # fields of the request by name
        )
        built.append(build_station(request))
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_the_script_is_measured_and_told_by_signals(build: Callable[..., BuiltStation]) -> None:
    station = build().station
    taken: list[MeasuredPoint] = []
    changes: list[str] = []
    station.events.point_taken.connect(taken.append)
    station.events.changed.connect(lambda: changes.append(threading.current_thread().name))
    station.start()
    assert station.wait_finished(HANG_S)
    assert station.job.view().complete
    assert [point.number for point in taken] == list(range(1, 15))
    assert set(changes) == {"ocmm-reconstruction"}
    status = station.looks.acquisition()
    assert status.elapsed == status.good + status.late + status.lost + status.bad
    assert (status.frames_lost, status.overrun) == (0, 0)
    # The source has ended: its last view is not shown as current.
    ended = station.looks.live()
    assert ended.frames_per_second == 0.0
    assert not np.isfinite(ended.spots).any()


def test_two_stations_do_not_hear_each_other(build: Callable[..., BuiltStation]) -> None:
    first, second = build().station, build(seed=2).station
    heard: list[MeasuredPoint] = []
    second.events.point_taken.connect(heard.append)
    first.start()
    assert first.wait_finished(HANG_S)
    assert heard == []


def test_a_refused_touch_is_made_again_by_the_operator(build: Callable[..., BuiltStation]) -> None:
    built = build()
    assert built.virtual is not None
    third = built.virtual.truth.touches[2]
    hidden = ScriptedOcclusion(-1, ALL_LEDS, third.first_frame, third.last_frame)
    station = build(world=WorldOptions(occlusions=(hidden,))).station
    refused: list[Refusal] = []
    station.events.point_refused.connect(refused.append)
    station.start()
    assert station.wait_finished(HANG_S)
    assert [item.code.value for item in refused] == ["lost"]
    assert refused[0].what == "The cameras do not see the probe."
    assert station.job.view().complete
    assert all(len(feature.points) == feature.needed for feature in station.job.view().features)


def test_live_number_goes_when_the_targets_go_and_says_why(
    build: Callable[..., BuiltStation],
) -> None:
    hidden = ScriptedOcclusion(-1, ALL_LEDS, 1000, 10**6)
    station = build(world=WorldOptions(occlusions=(hidden,)), speed=2.0, stay=True).station
    assert station.looks.live().status is StatusWord.NOT_READY
    assert station.looks.live().tip_world is None
    station.start()
    wait_until(lambda: station.looks.live().status is StatusWord.READY)
    seen = station.looks.live()
    assert seen.tip_world is not None
    assert seen.tip_uncertainty is not None
    assert 0.005 < seen.tip_uncertainty < 0.05
    assert np.isfinite(seen.spots).all(axis=2).sum() == 12
    wait_until(lambda: station.looks.live().status is StatusWord.LOST)
    lost = station.looks.live()
    assert (lost.tip_world, lost.tip_uncertainty, lost.origin_world) == (None, None, None)
    assert lost.reason == "The cameras do not see the probe."


@pytest.mark.timing
def test_take_arms_a_point_and_stop_comes_within_two_seconds(
    build: Callable[..., BuiltStation],
) -> None:
    station = build(speed=1.0, stay=True).station
    outcomes: list[object] = []
    station.events.point_taken.connect(outcomes.append)
    station.events.point_refused.connect(outcomes.append)
    station.start()
    wait_until(lambda: station.looks.live().status is StatusWord.READY)
    station.job.record_point()
    wait_until(lambda: len(outcomes) > 0)
    start = time.monotonic()
    station.close()
    assert time.monotonic() - start < BUSY * 2.0
    assert station.looks.acquisition().state is AcquisitionState.STOPPED
    station.close()


def test_export_writes_the_verdict_and_the_three_tables(
    build: Callable[..., BuiltStation], tmp_path: Path
) -> None:
    station = build().station
    station.start()
    assert station.wait_finished(HANG_S)
    names = [path.name for path in station.reports.export(tmp_path / "report")]
    kinds = ("job", "points", "features", "report")
    assert names[:4] == [f"QUICK-001_SIMULATED_{kind}.csv" for kind in kinds]


@pytest.mark.slow
def test_memory_stays_flat_at_8_khz(record_property: Callable[[str, object], None]) -> None:
    """Forty seconds of bus time at full speed; a leak of every spot would show.

    256 bytes of spots a frame, 36 s at 8 kHz between first and last sample: 70 MiB. Python's
    allocator needs a few MiB of play.
    """
    run = run_for(40.0, make_console())
    record_property("memory, MiB", " ".join(f"{value:.0f}" for value in run.memory_mib))
    assert len(run.memory_mib) == 10
    assert run.growth_mib < 12.0
