"""Server, client and network die at random moments; answered points are in the job, once."""

from __future__ import annotations

import random
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile
from tests.commands import Ocmm
from tests.serve.ippdme_client import ConnectionEndedError, DmeClient
from tests.serve.ippdme_commands import tool_names
from tests.serve.ippdme_frames import CHAIN, Array, rotation, to_active
from tests.serve.ippdme_grammar import Call, parse_answer
from tests.serve.ippdme_server import ServedProcess, jobs_in
from tests.slow_rig import slow_rig_in

LAST_DIGIT = 0.5e-6 + 1e-9
"""mm: half of the last digit that is sent."""


class Cable:
    """A TCP connection that can be cut: both ends see a reset."""

    def __init__(self, server: tuple[str, int]) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address: tuple[str, int] = self._listener.getsockname()[:2]
        self._server = server
        self._ends: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._join, name="cable")]
        self._threads[0].start()

    def _join(self) -> None:
        with suppress(OSError):
            near, _ = self._listener.accept()
            far = socket.create_connection(self._server)
            self._ends += [near, far]
            for source, target in ((near, far), (far, near)):
                thread = threading.Thread(target=self._forward, args=(source, target), name="wire")
                self._threads.append(thread)
                thread.start()

    def _forward(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65_536):
                target.sendall(data)
        with suppress(OSError):
            target.shutdown(socket.SHUT_WR)

    def cut(self) -> None:
        for end in self._ends:
            with suppress(OSError):
                end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
                # A thread that reads it does not notice its close.
                end.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in self._threads:
            thread.join()
        for end in self._ends:
            end.close()


@dataclass(frozen=True, slots=True)
class Answered:
    """A point as a client got it."""

    system: str
    given: Mapping[str, Sequence[float]]
    values: Mapping[str, tuple[float, ...]]


class Judge:
    """Measure with a server that dies now and then; `answered` has all points that arrived."""

    def __init__(self, out: Path, rig: Path, seed: int) -> None:
        self._out, self._rig = out, rig
        self._rng = random.Random(seed)  # noqa: S311 - kills that can be repeated
        self.answered: list[Answered] = []
        self.kills = 0
        self.server = self._serve()

    def _serve(self) -> ServedProcess:
        return ServedProcess(
            "ippdme", self._out, "--source", "simulated", "--port", "0", "--rig", str(self._rig)
        )

    def measure(self, victim: str, touches: int) -> None:
        """Measure in one session; the victim dies during its last touch, empty for none."""
        cable, client = self._connect()
        given = {name: self._transformation() for name in CHAIN}
        system = self._rng.choice([*CHAIN, "MachineCsy"])
        kill: Callable[[], None] = {
            "server": self.server.kill, "client": client.break_off, "network": cable.cut,
        }.get(victim, lambda: None)  # fmt: skip
        try:
            self._prepare(client, system, given)
            for touch in range(touches):
                command = self._touch(system, given)
                if victim and touch == touches - 1:
                    self._touch_and_kill(client, command, kill)
                else:
                    client.good(command)
            if not victim:
                client.good("EndSession()")
        except ConnectionEndedError:
            assert victim, client.log[-10:]
        finally:
            client.close()
            cable.cut()
        self._note_answers(client.log, system, given)
        if victim:
            self.kills += 1
        if victim == "server":
            self.server = self._serve()

    def _connect(self) -> tuple[Cable, DmeClient]:
        """Start a session; the server may not have noticed yet that the last client is gone."""
        while True:
            cable = Cable(self.server.address)
            client = DmeClient(cable.address)
            try:
                client.good("StartSession()")
            except ConnectionEndedError:
                client.close()
                cable.cut()
            else:
                return cable, client

    def _touch_and_kill(self, client: DmeClient, command: str, kill: Callable[[], None]) -> None:
        """Kill at the command, at a line of its answer, or at any time, and read on."""
        moment = self._rng.choice(["sent", "&", "#", "%", "later"])
        timer = threading.Timer(self._rng.uniform(0.0, 0.4), kill)
        if moment == "later":
            timer.start()
        elif moment != "sent":
            client.at_each = lambda line: kill() if line[6] == moment else None
        try:
            made = client.start(command)
            if moment == "sent":
                kill()
            # Answers on their way arrive.
            client.pump(lambda: made.done and moment != "later")
        finally:
            if moment == "later":
                timer.join()

    def _transformation(self) -> tuple[float, ...]:
        rng = self._rng
        shift = [round(rng.uniform(-200, 200), 3) for _ in range(3)]
        return (*shift, *(round(rng.uniform(0, most), 3) for most in (180, 360, 360)))

    def _prepare(
        self, client: DmeClient, system: str, given: Mapping[str, Sequence[float]]
    ) -> None:
        client.good("Home()")
        (tool, *_) = tool_names(client.good("EnumTools()").data)
        client.good(f'ChangeTool("{tool}")')
        client.good("OnPtMeasReport(Z(), X(), IJK(), Y(), ER())")
        for name, numbers in given.items():
            client.good(f"SetCsyTransformation({name}, {', '.join(map(str, numbers))})")
        client.good(f"SetCoordSystem({system})")

    def _touch(self, system: str, given: Mapping[str, Sequence[float]]) -> str:
        rng = self._rng
        place = np.array([rng.uniform(-60, 60), rng.uniform(-60, 60), rng.uniform(-10, 30)])
        normal = np.array([rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 1.0])
        x, y, z = to_active(place, system, given)
        i, j, k = to_active(normal / np.linalg.norm(normal), system, given, vector=True)
        return f"PtMeas(X({x:.6f}), Y({y:.6f}), Z({z:.6f}), IJK({i:.6f}, {j:.6f}, {k:.6f}))"

    def _note_answers(
        self, log: Sequence[str], system: str, given: Mapping[str, Sequence[float]]
    ) -> None:
        asked = {line[2:7] for line in log if line.startswith("> ") and "PtMeas" in line[8:]}
        for line in log:
            # An unasked event would be a second answer.
            assert "# PtMeas" not in line
            if line.startswith("< ") and line[2:7] in asked and line[8] == "#":
                items = parse_answer(line[2:]).items
                values = {item.name: item.numbers for item in items if isinstance(item, Call)}
                assert list(values) == ["Z", "X", "IJK", "Y", "ER"]
                self.answered.append(Answered(system, given, values))


def points_of(jobs: Sequence[Path]) -> list[MeasuredPoint]:
    """Return the points of jobs that count."""
    found: list[MeasuredPoint] = []
    for path in jobs:
        job = JobFile.read(path)
        points = job.points()
        assert len({point.number for point in points}) == len(points)
        windows = sorted((point.first_frame, point.last_frame) for point in points)
        # No touch is there twice.
        assert all(before[1] < after[0] for before, after in pairwise(windows))
        found += points
        job.close()
    return found


def places_in_jobs(answered: Sequence[Answered], points: Sequence[MeasuredPoint]) -> list[int]:
    """Return the place of each answer in the jobs; it must be there once, to the last digit."""
    tips = np.array([point.tip_world for point in points])
    places = []
    for one in answered:
        got = np.array([one.values[axis][0] for axis in "XYZ"])
        apart = np.abs([to_active(tip, one.system, one.given) - got for tip in tips]).max(axis=1)
        (same,) = np.nonzero(apart <= LAST_DIGIT)
        assert len(same) == 1, (one, apart.min())
        assert abs(one.values["ER"][0] - points[same[0]].tip_radius) <= LAST_DIGIT
        places.append(int(same[0]))
    return places


def test_keeps_each_answered_point_once_whatever_dies(
    tmp_path: Path, ocmm_here: Ocmm, repeats: Callable[..., int]
) -> None:
    out = tmp_path / "jobs"
    judge = Judge(out, slow_rig_in(tmp_path), 42)
    kills = repeats(6, 700)
    try:
        for kill in range(kills):
            # A start of the server costs as much as a dozen touches.
            each = 6 if kills < 100 else 3
            judge.measure("server" if kill % each == 2 else ("client", "network")[kill % 2], 2)
        judge.measure("", repeats(3, 8600))
        assert judge.server.stop() == 0, judge.server.text
        assert "Traceback" not in judge.server.text
    finally:
        judge.server.kill()
    jobs = jobs_in(out)
    points = points_of(jobs)
    places = places_in_jobs(judge.answered, points)
    assert len(set(places)) == len(places), "a point was answered twice"
    # A point may be durable while its answer is lost on the way: one a kill at most.
    assert len(judge.answered) <= len(points) <= len(judge.answered) + judge.kills
    assert len(judge.answered) >= kills
    _check_report(ocmm_here, jobs[-1], tmp_path / "report")


def _check_report(ocmm_here: Ocmm, job: Path, out: Path) -> None:
    """Read a job by the command that an inspector takes."""
    done = ocmm_here("report", job, "--incomplete", "--out", out)
    assert "Report" in done.stdout, done.stdout + done.stderr
    (table,) = out.glob("*_points.csv")
    rows = [line.split(",") for line in table.read_text().splitlines() if line.startswith("POINTS")]
    for row, point in zip(rows, points_of([job]), strict=True):
        surface, direction = np.array(row[1:4], float), np.array(row[4:7], float)
        ball: Array = surface + point.tip_radius * direction
        # Four decimals of the place, six of the direction.
        np.testing.assert_allclose(ball, point.tip_world, atol=6e-5)


def test_computes_frames_as_the_specification_shows() -> None:
    assert rotation(30, 40, 50)[0] == pytest.approx([0.065970, 0.921380, 0.383022], abs=5e-7)
    moved = to_active(np.array([2.0, 3.0, 4.0]), "MultipleArmCsy",
                      {"MultipleArmCsy": (5, 6, 7, 0, 0, 0)})  # fmt: skip
    assert moved.tolist() == [-3.0, -3.0, -3.0]
