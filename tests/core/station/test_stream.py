"""The live stream over a real socket: no point is lost, and nobody hears it who may not."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_core.cli.compose import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.inspection.view import JobHeader
from ocmm_core.station.station import MeasuringStation
from ocmm_core.station.stream_server import LONGEST_REQUEST, StreamOptions, StreamServer

TOKEN = "0123456789abcdef-token"  # noqa: S105 - of a test
TIMEOUT_S = 30.0
POINTS = 14  # of the quick plan
JOB = "QUICK-001"


@pytest.fixture
def station(tmp_path: Path) -> Iterator[MeasuringStation]:
    """Return the quick plan on the virtual rig, not begun yet."""
    plan = resource("plans", "quick.toml")
    built = build_station(StationRequest(plan=plan, out=tmp_path, frame_rate_hz=500)).station
    yield built
    built.close()


class Client:
    """A program that reads the stream."""

    def __init__(self, address: tuple[str, int], request: str | None = "") -> None:
        self._socket = socket.create_connection(address, timeout=TIMEOUT_S)
        self._lines = self._socket.makefile("rb")
        self.hello = self.line()
        if request is not None:
            self.say(request)

    def say(self, text: str) -> None:
        self._socket.sendall(text.encode() + b"\n")

    def line(self) -> dict[str, Any]:
        found = json.loads(self._lines.readline())
        assert isinstance(found, dict)
        return found

    def until(self, kind: str) -> dict[str, Any]:
        while (found := self.line())["type"] != kind:
            pass
        return found

    def numbered(self, count: int) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        while len(found) < count:
            line = self.line()
            if "seq" in line:
                found.append(line)
        return found

    def close(self) -> None:
        self._lines.close()
        self._socket.close()


def test_every_point_of_a_job_arrives_in_order_and_exactly(station: MeasuringStation) -> None:
    server = StreamServer(station, StreamOptions())
    address = server.start()
    # This one reads nothing until all is over; the other must not wait for it.
    with closing(Client(address, "")) as sleeper, closing(Client(address, "")) as client:
        assert client.hello["last_seq"] == 0
        station.start()
        points = client.numbered(POINTS)
        assert [point["seq"] for point in points] == list(range(1, POINTS + 1))
        assert station.wait_finished(TIMEOUT_S)
        for line, stored in zip(points, station.stored_job()[1], strict=True):
            assert (line["number"], line["feature"]) == (stored.number, stored.feature)
            np.testing.assert_array_equal(line["pos"], stored.tip_world)
            np.testing.assert_array_equal(line["surface"], stored.surface_world)
        assert [line["seq"] for line in sleeper.numbered(POINTS)] == list(range(1, POINTS + 1))
        assert server.close()
        assert "closed" in client.until("bye")["why"]


def test_a_pose_is_given_where_it_can_be_trusted_and_else_null(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions()) as server:
        address = server.address
        with closing(Client(address)) as client:
            pose = client.until("pose")
            assert (pose["status"], pose["pos"], pose["q"], pose["u"]) == (
                "NOT READY", None, None, None,
            )  # fmt: skip
            station.start()
            while (pose := client.until("pose"))["pos"] is None:
                pass
            assert np.linalg.norm(pose["q"]) == pytest.approx(1.0, abs=1e-12)
            assert pose["u"] > 0.0
            assert pose["units"] == "mm"


def test_a_client_resumes_after_the_last_number_it_has(station: MeasuringStation) -> None:
    station.start()
    assert station.wait_finished(TIMEOUT_S)
    with StreamServer(station, StreamOptions()) as server:
        with closing(Client(server.address, '{"poses": false}')) as first:
            first.numbered(5)
        with closing(Client(server.address, '{"resume": 5, "poses": false}')) as second:
            numbers = [line["seq"] for line in second.numbered(POINTS - 5)]
            assert numbers == list(range(6, POINTS + 1))
            # What is taken back is told, as what is turned round.
            station.undo()
            assert second.line() | {"v": 1} == second_of(POINTS + 1, POINTS)
            station.flip()
            gone, new = second.numbered(2)
            assert (gone["type"], gone["number"]) == ("annulled", POINTS - 1)
            assert (new["type"], new["approach"]) == ("point", "flipped")
        with closing(Client(server.address, '{"resume": 99}')) as stranger:
            assert "resume from 0" in stranger.until("bye")["why"]


def second_of(seq: int, number: int) -> dict[str, Any]:
    return {"v": 1, "type": "annulled", "seq": seq, "job": JOB, "number": number}


def test_the_points_of_the_next_part_follow_under_its_own_name(
    station: MeasuringStation,
) -> None:
    station.start()
    assert station.wait_finished(TIMEOUT_S)
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, '{"poses": false}')) as client,
    ):
        assert {line["job"] for line in client.numbered(POINTS)} == {JOB}
        first = station.job_path
        station.next_part(JobHeader("Ada", "DEMO_PART", "A-2", "12", "first"))
        station.go_on(first)
        # Nothing was annulled: the points of the first job come again when it goes on.
        again = client.numbered(POINTS)
        assert {(line["type"], line["job"]) for line in again} == {("point", JOB)}


def test_without_the_token_nothing_is_told(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions(token=TOKEN)) as server:
        for said in ("", '{"token": "0123456789abcdef-toke"}', '{"token": ""}'):
            with closing(Client(server.address, said)) as stranger:
                assert stranger.hello["token_needed"]
                assert stranger.line() == {"v": 1, "type": "bye", "why": "the token is wrong"}
        with closing(Client(server.address, json.dumps({"token": TOKEN}))) as friend:
            assert friend.line()["type"] == "pose"


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "measuring-room"])  # noqa: S104 - must be refused
def test_other_computers_need_a_token(station: MeasuringStation, host: str) -> None:
    with pytest.raises(InputError) as caught:
        StreamServer(station, StreamOptions(host=host, token="short"))  # noqa: S106 - of a test
    assert caught.value.code == "stream.token"


@pytest.mark.parametrize(
    "said",
    ['{"resume": -1}', '{"resume": "x"}', '{"run": "rm"}', "GET / HTTP/1.1", "x" * LONGEST_REQUEST],
)
def test_what_is_no_request_ends_the_talk_in_words(station: MeasuringStation, said: str) -> None:
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, said)) as client,
    ):
        assert client.line()["type"] == "bye"


def test_a_port_in_use_is_told(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions()) as server:
        second = StreamServer(station, StreamOptions(port=server.address[1]))
        with pytest.raises(MeasuringError) as caught:
            second.start()
        assert caught.value.code == "stream.address"
        assert second.close()


def test_nine_clients_are_one_too_many(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions()) as server:
        clients = [Client(server.address) for _ in range(8)]
        ninth = Client(server.address, None)
        assert ninth.hello["type"] == "bye"
        for client in [*clients, ninth]:
            client.close()
