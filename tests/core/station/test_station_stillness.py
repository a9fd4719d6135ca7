"""An operator whose ball drifts during a touch, in front of the whole station."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_sim.scene import BUTTON_DOWN_S, ScriptedNudge, WorldOptions
from tests.host import HANG_S

RATE_HZ = 2000
SHIFT_MM = 0.020

Build = Callable[[WorldOptions], BuiltStation]


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Build]:
    built: list[BuiltStation] = []

    def make(world: WorldOptions) -> BuiltStation:
        plan = resource("plans", "quick.toml")
        request = StationRequest(plan=plan, out=tmp_path, frame_rate_hz=RATE_HZ, world=world)
        built.append(build_station(request))
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_a_ball_that_drifts_is_refused_in_words_and_a_still_one_is_taken(build: Build) -> None:
    virtual = build(WorldOptions()).virtual
    assert virtual is not None
    third = virtual.truth.touches[2]
    # From the trigger on, for as long as a window; seen from the cameras the ball glides.
    begin = round((third.contact_s + BUTTON_DOWN_S) * RATE_HZ)
    glide = ScriptedNudge(begin, round(0.25 * RATE_HZ), shift=(SHIFT_MM, 0.0, 0.0))
    station = build(WorldOptions(nudges=(glide,))).station
    taken: list[MeasuredPoint] = []
    refused: list[Refusal] = []
    station.events.point_taken.connect(taken.append)
    station.events.point_refused.connect(refused.append)
    station.start()
    assert station.wait_finished(HANG_S)
    assert [item.code.value for item in refused] == ["moving"]
    said = re.fullmatch(
        r"The ball (drifted|slipped) by (0\.\d{3}) mm while it was measured\.", refused[0].what
    )
    assert said is not None, refused[0].what
    # A glide with a soft begin and end is longer as an even drift, shorter as a slip.
    assert 0.7 * SHIFT_MM < float(said[2]) < 1.5 * SHIFT_MM
    assert refused[0].remedy == "Hold the ball still on the surface until the tone."
    # The operator touches there again; no other touch was refused.
    assert station.job.view().complete
    assert [point.number for point in taken] == list(range(1, 15))
