"""The live stream over a real socket: no point is lost, and strangers receive nothing."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.inspection.evaluation import JobHeader, JobView
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import ButtonChange, ButtonWatch, StreamOptions, StreamServer
from ocmm_core.station.stream import _client as stream_client
from ocmm_core.station.stream._client import (
    BLOCK,
    IN_MEMORY,
    LONGEST_REQUEST,
    MOST_WAITING,
    StreamClient,
    StreamLog,
)
from ocmm_core.station.stream._messages import VerdictWatch
from tests.host import HANG_S

TOKEN = "0123456789abcdef-token"  # noqa: S105 - of a test
TIMEOUT_S = HANG_S
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

    def __init__(
        self, address: tuple[str, int], request: str | None = "", receive: int | None = None
    ) -> None:
        self._socket = socket.socket()
        if receive is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
        self._socket.settimeout(TIMEOUT_S)
        self._socket.connect(address)
        self._lines = self._socket.makefile("rb")
        self.numbered: list[dict[str, Any]] = []
        self.states: list[tuple[str, str]] = []
        self.hello = self.line()
        if request is not None:
            self.say(request)

    def say(self, text: str) -> None:
        self._socket.sendall(text.encode() + b"\n")

    def line(self) -> dict[str, Any]:
        found = json.loads(self._lines.readline())
        assert isinstance(found, dict)
        if found["type"] == "status":
            self.states.append((found["status"], found["reason"]))
        elif found["type"] == "pose":
            # The state in a pose was reported before.
            assert (found["status"], found["reason"]) == self.states[-1]
        return found

    def until(self, kind: str) -> dict[str, Any]:
        while (found := self.line())["type"] != kind:
            pass
        return found

    def steps(self, count: int) -> list[dict[str, Any]]:
        """Return the next points and annulments; ``numbered`` has what came with a number."""
        found: list[dict[str, Any]] = []
        while len(found) < count:
            line = self.line()
            if "seq" in line:
                self.numbered.append(line)
            if line["type"] in ("point", "annulled"):
                found.append(line)
        return found

    def close(self) -> None:
        self._lines.close()
        self._socket.close()


def test_every_point_of_a_job_arrives_in_order_and_exactly(station: MeasuringStation) -> None:
    server = StreamServer(station, StreamOptions(poses_hz=500.0))
    with server:
        address = server.address
        with (
            # This one reads nothing until the end, and its buffers in the system are full soon. No
            # other client waits for it.
            closing(Client(address, "", receive=2048)) as sleeper,
            closing(Client(address, '{"poses": false}')) as client,
        ):
            assert client.hello["last_seq"] == 0
            while not server.poses_missed:
                time.sleep(0.01)
            station.start()
            points = client.steps(POINTS)
            assert station.wait_finished(TIMEOUT_S)
            for line, stored in zip(points, station.job.stored()[1], strict=True):
                assert (line["number"], line["feature"]) == (stored.number, stored.feature)
                np.testing.assert_array_equal(line["pos"], stored.tip_world)
                np.testing.assert_array_equal(line["surface"], stored.surface_world)
            assert sleeper.steps(POINTS) == points
            assert sleeper.numbered == client.numbered
            numbers = [line["seq"] for line in client.numbered]
            assert numbers == list(range(1, len(numbers) + 1))
            # Before every point the button went down, and it came up again before the next.
            events = [line.get("event", line["type"]) for line in client.numbered]
            assert "".join(events).replace("release", "") == "presspoint" * POINTS
            pressed = [line for line in client.numbered if line.get("event") == "press"]
            for press, point in zip(pressed, points, strict=True):
                assert 0.0 < point["t"] - press["t"] < 0.2
            held = [line["held_s"] for line in client.numbered if line.get("event") == "release"]
            assert len(held) >= POINTS - 1
            assert all(0.0 < seconds < 1.0 for seconds in held)
            assert server.close()
            assert "closed" in client.until("bye")["why"]
            # Every change of the state was reported once.
            assert client.states[0][0] == "NOT READY"
            assert all(before != after for before, after in pairwise(client.states))
            assert {status for status, _ in client.states} & {"READY", "MEASURING"}


def test_what_waits_for_a_stalled_client_is_bounded_and_complete(tmp_path: Path) -> None:
    log = StreamLog(tmp_path)
    for _ in range(3000):
        log.append(lambda seq: b'{"seq":%d}' % seq + b" " * 1000 + b"\n")

    async def talk() -> None:
        ours, theirs = socket.socketpair()
        loop = asyncio.get_running_loop()
        transport, _ = await loop.connect_accepted_socket(asyncio.Protocol, ours)
        reader, writer = await asyncio.open_connection(sock=theirs, limit=2048)
        client = StreamClient("here", 0.0, 0.0, transport, begun=True)
        for _ in range(50):
            client.fill(log)
            assert client.waiting < MOST_WAITING + 1100 * BLOCK
            await asyncio.sleep(0)
        assert client.next_seq < 3000
        for number in range(1, 3001):
            client.fill(log)
            line = await asyncio.wait_for(reader.readline(), TIMEOUT_S)
            assert json.loads(line)["seq"] == number
        transport.close()
        writer.close()
        await writer.wait_closed()

    asyncio.run(talk())
    log.close()


def test_older_lines_are_in_a_file_and_come_back_in_order(tmp_path: Path) -> None:
    log = StreamLog(tmp_path)
    count = 2 * IN_MEMORY + 100
    for _ in range(count):
        log.append(lambda seq: b"%d\n" % seq)
    assert len(log) == count
    assert log.in_memory == IN_MEMORY
    for first in (1, 2, BLOCK, BLOCK + 1, count - IN_MEMORY, count - IN_MEMORY + 1, count):
        told, number = b"", first
        while number <= count:
            lines, number = log.read(number)
            told += lines
        assert told == b"".join(b"%d\n" % seq for seq in range(first, count + 1))
    log.close()
    assert list(tmp_path.iterdir()) == []


def test_where_no_file_can_be_made_lines_stay_in_memory(tmp_path: Path) -> None:
    log = StreamLog(tmp_path / "missing")
    for _ in range(IN_MEMORY + 10):
        log.append(lambda seq: b"%d\n" % seq)
    assert log.in_memory == IN_MEMORY + 10
    assert log.read(1)[0].startswith(b"1\n2\n")


def test_a_press_and_a_release_are_found_wherever_blocks_are_cut() -> None:
    flags = np.array([1, 1, 0, 0, 1, 1, 1, 0, 1], dtype=np.uint32)
    wanted = [
        ButtonChange("release", 102, 0.002),
        ButtonChange("press", 104, 0.004),
        ButtonChange("release", 107, 0.007, 0.007 - 0.004),
        ButtonChange("press", 108, 0.008),
    ]
    for size in (1, 2, 4, 9):
        watch, found = ButtonWatch(), []
        for first in range(0, len(flags), size):
            part = flags[first : first + size]
            counter = 100 + np.arange(first, first + len(part))
            found += watch.push(
                FrameBlock(
                    counter=counter, time_ns=(counter - 100) * 1_000_000, flags=part,
                    valid=np.zeros((len(part), 2), np.uint64), uv=np.zeros((len(part), 2, 8, 2)),
                )
            )  # fmt: skip
        assert found == wanted


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
    # This server begins at the end: it reads the points from the job file, and has no button.
    with StreamServer(station, StreamOptions()) as server:
        with closing(Client(server.address, '{"poses": false}')) as first:
            first.steps(5)
        with closing(Client(server.address, '{"resume": 5, "poses": false}')) as second:
            numbers = [line["seq"] for line in second.steps(POINTS - 5)]
            assert numbers == list(range(6, POINTS + 1))
            # Undo is reported like a reversal.
            station.job.change(lambda session: session.steps.undo())
            gone = {"seq": POINTS + 1, "job": JOB, "number": POINTS}
            assert second.steps(1) == [{"v": 1, "type": "annulled"} | gone]
            station.job.change(lambda session: session.points.flip())
            gone, new = second.steps(2)
            assert (gone["type"], gone["number"]) == ("annulled", POINTS - 1)
            assert (new["type"], new["approach"]) == ("point", "flipped")
        with closing(Client(server.address, '{"resume": 99}')) as stranger:
            assert "resume from 0" in stranger.until("bye")["why"]
    # A server that begins later reports the whole history of the job from its file.
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, '{"poses": false}')) as late,
    ):
        assert [line["type"] for line in late.steps(POINTS + 3)[POINTS:]] == [
            "annulled", "annulled", "point",
        ]  # fmt: skip


def told_until(client: Client, last_seq: int) -> dict[str, Any]:
    """Return the first verdict that holds everything up to a number."""
    while (found := client.until("verdict"))["after"] < last_seq:
        pass
    return found


def test_the_verdict_follows_every_change_and_is_that_of_the_job(station: MeasuringStation) -> None:
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, '{"poses": false}')) as client,
    ):
        assert client.hello["simulated"] is True
        first = client.until("verdict")
        assert (first["part"], first["complete"]) == ("NOT COMPLETE", False)
        assert {item["verdict"] for item in first["characteristics"]} <= {
            "NOT MEASURED", "PROVISIONAL",
        }  # fmt: skip
        station.start()
        points = client.steps(POINTS)
        last = told_until(client, points[-1]["seq"])
        assert station.wait_finished(TIMEOUT_S)
        view = station.job.view()
        part = view.part_verdict
        assert last["part"] == part.word.value == "PART CONFORMS"
        assert (last["job"], last["simulated"], last["missing"]) == (JOB, True, [])
        assert {item["name"]: item["verdict"] for item in last["characteristics"]} == {
            item.name: item.verdict.value for item in view.characteristics
        }
        for item in last["features"]:
            summary = view.verdict_of(item["name"])
            wanted = None if summary.verdict is None else summary.verdict.value
            assert (item["verdict"], item["deciding"]) == (wanted, summary.deciding)
            assert item["state"] == "done"
        # A point that goes takes the verdict with it.
        station.job.change(lambda session: session.steps.undo())
        (gone,) = client.steps(1)
        after = told_until(client, gone["seq"])
        assert after["part"] == station.job.view().part_verdict.word.value == "NOT COMPLETE"
        assert after["missing"][0] == points[-1]["feature"]


def test_a_job_that_cannot_be_evaluated_takes_the_verdict_back(station: MeasuringStation) -> None:
    class Broken:
        """Cannot evaluate twice, then it can."""

        def __init__(self) -> None:
            self.errors = [MeasuringError("x.y", "It broke.", "Mend it."), ValueError("bug")]

        def __call__(self) -> JobView:
            if self.errors:
                raise self.errors.pop(0)
            return station.job.view()

    made = threading.Semaphore(0)
    watch = VerdictWatch(Broken(), lambda: JOB, lambda: 7, made.release)
    watch.start()
    lines = []
    for _ in range(3):
        watch.request()
        assert made.acquire(timeout=TIMEOUT_S)
        lines.append(json.loads(watch.latest.line))
    assert watch.close(TIMEOUT_S)
    assert [(line["part"], line["reason"].partition(" (")[0]) for line in lines] == [
        (None, "It broke. Mend it."),
        (None, "The verdict for the stream failed: ValueError: bug"),
        ("NOT COMPLETE", ""),
    ]
    assert {(line["type"], line["job"], line["after"]) for line in lines} == {("verdict", JOB, 7)}


def test_the_points_of_the_next_part_follow_under_its_own_name(station: MeasuringStation) -> None:
    station.start()
    assert station.wait_finished(TIMEOUT_S)
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, '{"poses": false}')) as client,
    ):
        assert {line["job"] for line in client.steps(POINTS)} == {JOB}
        first = station.job.path
        station.jobs.next_part(JobHeader("Ada", "DEMO_PART", "A-2", "12", "first"))
        station.jobs.go_on(first)
        # Nothing was annulled: the points of the first job come again when it goes on.
        again = client.steps(POINTS)
        assert {(line["type"], line["job"]) for line in again} == {("point", JOB)}


def test_without_the_token_nothing_is_told(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions(token=TOKEN)) as server:
        for said in ("", '{"token": "0123456789abcdef-toke"}', '{"token": ""}'):
            with closing(Client(server.address, said)) as stranger:
                assert stranger.hello["token_needed"]
                assert stranger.line() == {"v": 1, "type": "bye", "why": "the token is wrong"}
        with closing(Client(server.address, json.dumps({"token": TOKEN}))) as friend:
            assert friend.line()["type"] == "status"


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


def test_a_client_that_says_nothing_is_told_why_it_ends(
    station: MeasuringStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream_client, "REQUEST_TIMEOUT_S", 0.05)
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(Client(server.address, None)) as mute,
    ):
        assert "no request within" in mute.line()["why"]


def test_nine_clients_are_one_too_many(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions()) as server:
        clients = [Client(server.address) for _ in range(8)]
        # A client without a request takes no place, and may get none later.
        for client in clients:
            client.until("status")
        ninth = Client(server.address, "")
        assert ninth.line()["why"] == "already 8 clients"
        for client in [*clients, ninth]:
            client.close()
