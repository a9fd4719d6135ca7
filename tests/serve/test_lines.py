"""Points as lines: each accepted point once, in the format that was stated."""

from __future__ import annotations

import os
import pty
import socket
import tty
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import (
    PlainLines,
    StreamOptions,
    StreamServer,
    check_stream,
    may_connect,
)
from ocmm_serve.lines._feed import LineFeed, SerialReceiver
from ocmm_serve.lines._template import LineTemplate
from tests.commands import Ocmm
from tests.host import HANG_S, on_linux_only
from tests.serve.ippdme_server import ServedProcess, jobs_in
from tests.serve.test_ippdme_kills import points_of
from tests.waiting import wait_until

POINTS = 14  # of the quick plan
CSV = LineTemplate.parse("{n};{x:.4f};{y:.4f};{z:.4f}")


@pytest.fixture
def station(tmp_path: Path) -> Iterator[MeasuringStation]:
    """Return the quick plan on the virtual rig, not started."""
    plan = resource("plans", "quick.toml")
    built = build_station(StationRequest(plan=plan, out=tmp_path, frame_rate_hz=500)).station
    yield built
    built.close()


def plain(notes: list[str], template: LineTemplate = CSV) -> PlainLines:
    return PlainLines(lambda point: template.line(point).encode("ascii") + b"\r\n", notes.append)


def lines_of(points: list[MeasuredPoint]) -> list[str]:
    """Return the lines that a program must get, written from the job."""
    return [
        ";".join([str(one.number), *(f"{value:.4f}" for value in one.tip_world)]) for one in points
    ]


def listening(server: StreamServer) -> int:
    """Return the number of programs that get lines."""
    # The thread of the server makes its reception.
    reception = getattr(server, "_reception", None)
    return 0 if reception is None else len(reception.listening)


def measure(station: MeasuringStation) -> None:
    station.start()
    assert station.wait_finished(HANG_S)


@pytest.mark.parametrize(
    ("text", "options", "line"),
    [
        ("{x:.4f},{y:.4f},{z:.4f}", {}, "-0.5000,1234.5678,0.0000"),
        ("{x},{y},{z}", {}, "-0.5000,1234.5678,0.0000"),
        ("X{x:.3f} Y{y:.3f} Z{z:.3f}", {}, "X-0.500 Y1234.568 Z0.000"),
        ("{n:04d}\\t{x:+010.3f}\\t{y}\\t{z}", {}, "0007\t-00000.500\t1234.5678\t0.0000"),
        ("{x:.0f},{y:.0f},{z:.0f}", {"unit": "um"}, "-500,1234568,0"),
        ("{x:.5f} {y:.5f} {z:.5f}", {"unit": "inch"}, "-0.01969 48.60503 0.00000"),
        ("{x};{y};{z}", {"decimal": "comma"}, "-0,5000;1234,5678;0,0000"),
        ("{x} {y} {z} {i} {j} {k} {r}", {"kind": "surface"},
         "-0.5000 1234.5678 -3.0000 0.0000 0.0000 1.0000 3.0000"),
        ("{{{x}}} {y} {z}", {}, "{-0.5000} 1234.5678 0.0000"),
    ],
)  # fmt: skip
def test_writes_points_by_the_template(text: str, options: dict[str, object], line: str) -> None:
    nothing = np.empty((0, 0, 2))
    point = MeasuredPoint(
        7, "P", 0.0, 1, 2, 2, np.array([-0.5, 1234.56783, -0.00001]), np.eye(3),
        np.array([0.0, 0.0, 1.0]), 3.0, np.eye(3), nothing, 1.0, "trail",
    )  # fmt: skip
    assert LineTemplate.parse(text, **options).line(point) == line  # type: ignore[arg-type] # of the table


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "lacks {x}, {y}, {z}"), ("{x} {y}", "lacks {z}"), ("{x} {y} {z} {x}", "twice"),
        ("{x.__class__} {y} {z}", "not a field"), ("{x!r} {y} {z}", "not a field"),
        ("{0} {y} {z}", "not a field"), ("{} {y} {z}", "not a field"),
        ("{x[0]} {y} {z}", "not a field"), ("{x:{y}} {y} {z}", "width"), ("{x:e} {y} {z}", "width"),
        ("{x:.4f} {y} {z", "cannot be used"), ("{x:>9999999999} {y} {z}", "width"),
        ("{x:.1f} {y} {z}", "round to 0.1 mm"), ("{x:.0f} {y} {z}", "round to 1 mm"),
        ("{x}{y} {z}", "run together"), ("{x}-{y} {z}", "run together"),
        ("{x}1{y} {z}", "run together"), ("{x}E{y} {z}", "run together"),
        ("P1{x} {y} {z}", "run together"), ("µ{x} {y} {z}", "ASCII"), ("{x}\n{y} {z}", "ASCII"),
        ("{n:.2f} {x} {y} {z}", "no decimals"), ("{x:5d} {y} {z}", "has decimals"),
        ("{i:.1f} {x} {y} {z}", "round to"), ("{x} {y} {z}" + " " * 300, "200 characters"),
    ],
)  # fmt: skip
def test_refuses_templates_that_lose_or_join_numbers(text: str, why: str) -> None:
    with pytest.raises(InputError) as caught:
        LineTemplate.parse(text)
    assert why in caught.value.what


def test_refuses_a_comma_between_numbers_with_a_comma() -> None:
    with pytest.raises(InputError, match="run together"):
        LineTemplate.parse("{x},{y},{z}", decimal="comma")


def test_sends_each_point_once_over_tcp(station: MeasuringStation) -> None:
    notes: list[str] = []
    with (
        StreamServer(station, StreamOptions(), plain=plain(notes)) as server,
        closing(socket.create_connection(server.address, HANG_S)) as first,
        closing(socket.create_connection(server.address, HANG_S)) as second,
    ):
        # It will say nothing, and closes that half.
        second.shutdown(socket.SHUT_WR)
        wait_until(lambda: listening(server) == 2)
        measure(station)
        measured = station.job.stored()[1]
        # A deleted point is named to the operator; restored, it has a new number.
        station.job.change(lambda session: session.steps.undo())
        station.job.change(lambda session: session.steps.redo())
        restored = station.job.stored()[1][-1]
        assert restored.number == POINTS + 1
        lines = lines_of([*measured, restored])
        expected = "".join(line + "\r\n" for line in lines).encode()
        # A program that comes later gets nothing that was measured before.
        with closing(socket.create_connection(server.address, HANG_S)) as late:
            wait_until(lambda: listening(server) == 3)
            assert server.close()
            for client, wanted in ((first, expected), (second, expected), (late, b"")):
                with client.makefile("rb") as got:
                    assert got.read() == wanted
    assert [note for note in notes if f"Point {POINTS} was annulled" in note] == notes[:1]
    assert len(notes) == 1


def test_tells_the_operator_that_no_program_is_connected(station: MeasuringStation) -> None:
    notes: list[str] = []
    with StreamServer(station, StreamOptions(), plain=plain(notes)):
        measure(station)
        wait_until(lambda: sum(int(note.split(": ")[1].split()[0]) for note in notes) == POINTS)
    assert all(note.startswith("No program is connected") for note in notes)


def test_ends_clients_beyond_the_quota(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions(), plain=plain([])) as server:
        clients = [socket.create_connection(server.address, HANG_S) for _ in range(8)]
        wait_until(lambda: listening(server) == 8)
        with closing(socket.create_connection(server.address, HANG_S)) as ninth:
            assert ninth.recv(100) == b""
        # Input of a client has no effect, within limits.
        clients[0].sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert listening(server) == 8
        for client in clients:
            client.close()


def test_lets_known_addresses_in() -> None:
    with pytest.raises(InputError, match="could connect"):
        check_stream(StreamOptions(host="0.0.0.0"), by_address=True)  # noqa: S104 - is refused
    with pytest.raises(InputError, match="not an address"):
        check_stream(StreamOptions(allow=("192.168.1.300",)), by_address=True)
    listed = StreamOptions(host="0.0.0.0", allow=("192.168.1.20", "10.0.0.0/24"))  # noqa: S104 - as above
    check_stream(listed, by_address=True)
    # The JSON stream still requires its token.
    with pytest.raises(InputError):
        check_stream(listed)
    for address, may in (
        ("192.168.1.20", True), ("::ffff:192.168.1.20", True), ("10.0.0.77", True), ("::1", True),
        ("127.0.0.1", True), ("192.168.1.21", False), ("10.0.1.1", False), ("fe80::1%eth0", False),
    ):  # fmt: skip
        assert may_connect(listed, address) is may


def test_closes_connections_of_other_addresses(
    station: MeasuringStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    # All addresses of this computer are loopback; the server must see another one.
    name = "ocmm_core.station.stream._server.may_connect"
    monkeypatch.setattr(name, lambda options, address: False)
    with (
        StreamServer(station, StreamOptions(), plain=plain([])) as server,
        closing(socket.create_connection(server.address, HANG_S)) as stranger,
    ):
        assert stranger.recv(100) == b""


@on_linux_only
def test_sends_each_point_once_over_a_serial_line(
    station: MeasuringStation, tmp_path: Path
) -> None:
    near, far = pty.openpty()
    tty.setraw(far)
    notes: list[str] = []
    receiver = SerialReceiver(os.ttyname(far), 115_200)
    with (
        os.fdopen(near, "rb", buffering=0) as line,
        LineFeed(station, plain(notes), receiver, notes.append),
    ):
        measure(station)
        wanted = "".join(one + "\r\n" for one in lines_of(station.job.stored()[1])).encode()
        got = b""
        while len(got) < len(wanted):
            got += line.read(4096)
        assert got == wanted
    os.close(far)
    assert notes == []


@on_linux_only
def test_ends_in_time_where_a_serial_line_takes_nothing(station: MeasuringStation) -> None:
    near, far = pty.openpty()
    notes: list[str] = []
    flood = PlainLines(lambda point: b"." * 100_000 + b"\n", notes.append)
    with LineFeed(station, flood, SerialReceiver(os.ttyname(far)), notes.append):
        measure(station)
    # One write may wait for its limit of 2 s, and the end for another.
    assert notes
    assert "Not sent, or in part" in notes[0]
    os.close(near)
    os.close(far)


@on_linux_only
def test_reports_points_that_a_serial_line_did_not_take(station: MeasuringStation) -> None:
    near, far = pty.openpty()
    notes: list[str] = []
    with LineFeed(station, plain(notes), SerialReceiver(os.ttyname(far)), notes.append):
        os.close(far)
        # The cable is pulled out.
        os.close(near)
        measure(station)
        wait_until(lambda: len(notes) == POINTS)
    assert all("did not take it" in note and "touch this point again" in note for note in notes)


def test_refuses_a_device_that_is_not_there() -> None:
    with pytest.raises(InputError, match="cannot be opened"):
        SerialReceiver("/dev/no-such-line")


def test_serves_lines_by_the_command(tmp_path: Path, slow_rig: Path) -> None:
    served = ServedProcess(
        "lines", tmp_path, "--source", "simulated", "--port", "0", "--rig", str(slow_rig),
        "--template", "{n};{x:.4f};{y:.4f};{z:.4f}", "--end", "lf", "--speed", "0",
        "--plan", str(resource("plans", "quick.toml")),
    )  # fmt: skip
    try:
        with (
            closing(socket.create_connection(served.address, HANG_S)) as client,
            client.makefile("r") as stream,
        ):
            got = [stream.readline().strip() for _ in range(2)]
            code = served.stop()
            got += stream.read().split()
        assert code == 0, served.text
    finally:
        served.kill()
    assert "Ball centres (radius not compensated) in mm" in served.text
    (job,) = jobs_in(tmp_path)
    wanted = lines_of(points_of([job]))
    # The last line may be cut off by the end of the server; its point is in the job.
    assert got[:2] == wanted[wanted.index(got[0]) :][:2]
    assert len(set(got)) == len(got) <= len(wanted)


def test_says_what_is_wrong_with_options(ocmm_here: Ocmm, tmp_path: Path) -> None:
    cases: list[tuple[tuple[str, ...], str]] = [
        (("--template", "{x:.0f}"), "round to 1 mm"),
        (("--host", "0.0.0.0"), "could connect"),  # noqa: S104 - is refused
        (("--device", "/dev/ttyX", "--port", "5"), "ask for TCP"),
        (("--end", "nl"), "'crlf'"),
    ]
    for options, said in cases:
        done = ocmm_here("serve", "lines", "--out", tmp_path, *options)
        assert done.returncode == 2
        assert said in done.stderr
    # Nothing was started.
    assert jobs_in(tmp_path) == []
