"""A touch that the measuring chain refuses is never answered."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_sim.scene import ScriptedNudge, WorldOptions
from tests.serve.ippdme_client import DmeClient, session
from tests.serve.ippdme_commands import tool_names
from tests.serve.ippdme_grammar import Call
from tests.serve.ippdme_station import RATE_HZ, ServedStation, served_station
from tests.waiting import wait_until

GLIDE_S = 20.0
GLIDES = tuple(
    ScriptedNudge(
        round(number * GLIDE_S * RATE_HZ), round(GLIDE_S * RATE_HZ),
        shift=(2.0 * (-1) ** number, 0.0, 0.0),
    )
    for number in range(40)
)  # fmt: skip
"""The part glides forth and back all the time, 0.1 mm a second."""
REFUSED = {1000, 1001, 1006, 1501}
"""Not ready, illegal touch, no touch, not armed."""


class Witness:
    """Decisions of the measuring chain, by its own signals."""

    def __init__(self, served: ServedStation) -> None:
        self.taken: list[MeasuredPoint] = []
        self.refused: list[Refusal] = []
        served.built.station.events.point_taken.connect(self.taken.append)
        served.built.station.events.point_refused.connect(self.refused.append)


def _prepare(client: DmeClient) -> None:
    client.good("Home()")
    (tool, *_) = tool_names(client.good("EnumTools()").data)
    client.good(f'ChangeTool("{tool}")')
    client.good("SetCoordSystem(MachineCsy)")


@pytest.mark.parametrize(
    "world",
    [WorldOptions(nudges=GLIDES), WorldOptions(occlusion_rate_hz=8.0)],
    ids=["moving", "occluded"],
)
def test_answers_no_refused_touch(
    tmp_path: Path, world: WorldOptions, repeats: Callable[..., int]
) -> None:
    needed = repeats(8, 500)
    answers: list[tuple[float, ...]] = []
    with served_station(tmp_path, world=world, tries=3) as served:
        witness = Witness(served)
        with session(served.address) as client:
            _prepare(client)
            while len(witness.refused) < needed:
                number = len(witness.refused) + len(witness.taken)
                x, y = (number % 9 - 4) * 10.0, (number // 9 % 9 - 4) * 10.0
                before = len(witness.taken)
                done = client.call(f"PtMeas(X({x}), Y({y}), Z(0), IJK(0, 0, 1))")
                if done.errors:
                    assert done.data == []
                    assert set(done.numbers) <= REFUSED
                    client.good("ClearAllErrors()")
                else:
                    answers.append(tuple(done.values()[axis][0] for axis in "XYZ"))
                    # The server's slot is called before that of the witness.
                    wait_until(lambda: len(witness.taken) > before)  # noqa: B023 - called at once
            # Nothing came unasked.
            assert [one.items for one in client.events if one.error is None] == []
        accepted = [tuple(point.tip_world) for point in witness.taken]
    assert len(answers) <= len(accepted)
    for answer in answers:
        assert np.abs(np.array(accepted) - answer).max(axis=1).min() < 1e-6
    # The operator read why, each time.
    assert len(witness.refused) >= needed


def test_answers_no_touch_from_before_the_command(
    tmp_path: Path, repeats: Callable[..., int]
) -> None:
    with served_station(tmp_path) as served:
        witness = Witness(served)
        hand, live = served.built.hand, served.built.station.looks.live
        with session(served.address) as client:
            _prepare(client)
            for number in range(repeats(6, 200)):
                x = (number % 9 - 4) * 10.0
                # The operator touches the right place too early.
                hand.touch_place(np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
                client.poll(0.02 * (number % 10))
                asked = live().frame_counter
                done = client.good(f"PtMeas(X({x}), Y(0), Z(0), IJK(0, 0, 1))")
                got = [item.numbers[0] for item in done.only if isinstance(item, Call)]
                found: list[MeasuredPoint] = []
                while not found:  # The server's slot is called before that of the witness.
                    client.poll(0.01)
                    found = [
                        one for one in witness.taken if np.abs(one.tip_world - got).max() < 1e-6
                    ]
                assert [one.first_frame > asked for one in found] == [True]
            assert client.events == []
        assert len(witness.taken) >= 6


def test_sends_points_of_a_leading_operator_only_while_he_is_enabled(tmp_path: Path) -> None:
    with served_station(tmp_path) as served:
        witness = Witness(served)
        with session(served.address) as client:
            _prepare(client)
            client.good("OnPtMeasReport(X(), Y(), Z(), ER())")
            client.good("EnableUser()")
            client.pump(lambda: len(client.events) >= 3)
            client.good("DisableUser()")
            told = len(client.events)
            hand = served.built.hand
            hand.touch_place(np.zeros(3), np.array([0.0, 0.0, 1.0]))
            before = len(witness.taken)
            while len(witness.taken) == before:
                client.poll(0.05)
            client.good("GetErrStatusE()")
            assert len(client.events) == told
        for event in client.events:
            (call,) = event.items
            assert isinstance(call, Call)
            values = [item.numbers[0] for item in call.items if isinstance(item, Call)]
            found = [
                one for one in witness.taken if np.abs(one.tip_world - values[:3]).max() < 1e-6
            ]
            assert len(found) == 1
