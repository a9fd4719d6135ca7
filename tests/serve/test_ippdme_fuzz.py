"""Lines of any bytes: each is answered in the grammar, and the next session works."""

from __future__ import annotations

import random
import re
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.serve.ippdme_client import DmeClient, session
from tests.serve.ippdme_commands import Commands
from tests.serve.ippdme_grammar import parse_answer
from tests.serve.ippdme_station import pure_session, served_station


def _lines(rng: random.Random) -> list[bytes]:
    """Return commands to be spoiled."""
    commands = Commands(rng, "1.4", ["standard"])
    cases = [commands.valid() for _ in range(60)] + [commands.broken() for _ in range(140)]
    lines = [case.whole or f"{rng.randrange(1, 99_999):05d} {case.text}".encode() for case in cases]
    # These end a session, or rotate its job.
    return [line for line in lines if b"Session" not in line]


def _spoil(rng: random.Random, line: bytes, other: bytes) -> bytes:
    match rng.randrange(7):
        case 0:
            return line
        case 1:
            at = rng.randrange(len(line) + 1)
            return line[:at] + bytes([rng.randrange(256)]) + line[at:]
        case 2:
            at = rng.randrange(max(len(line), 1))
            return line[:at] + line[at + rng.randrange(1, 9) :]
        case 3:
            return line[: rng.randrange(len(line) + 1)] + other[rng.randrange(len(other) + 1) :]
        case 4:
            at = rng.randrange(len(line) + 1)
            return (
                line[:at] + rng.choice([b"(", b")", b",", b'"', b".", b"-", b"0", b" "]) + line[at:]
            )
        case 5:
            return rng.randbytes(rng.randrange(40))
        case _:
            return line[:6] + line[6:] * rng.randrange(1, 4)


def test_answers_any_line_in_the_grammar(tmp_path: Path, repeats: Callable[..., int]) -> None:
    rng = random.Random(7)  # noqa: S311 - lines that can be repeated
    # No socket, so that lines cost microseconds.
    with pure_session(tmp_path) as one:
        one.receive(b"00001 StartSession()")
        one.pop_lines()
        lines = _lines(rng)
        for _ in range(repeats(4000, 1_000_000)):
            line = _spoil(rng, rng.choice(lines), rng.choice(lines)).replace(b"\r\n", b"")
            if b"Session" in line:
                continue
            one.receive(line)
            answers = [parse_answer(text) for text in one.pop_lines()]
            own = "".join(answer.kind for answer in answers if answer.tag != "E0000")
            unasked = [answer.kind for answer in answers if answer.tag == "E0000"]
            assert re.fullmatch("&[#!]*%?", own) or (own == "" and unasked[0] == "!"), line
            if own and "%" not in own:
                # A measurement that waits for a touch.
                one.receive(b"E0001 AbortE()")
                aborted = [parse_answer(text) for text in one.pop_lines()]
                assert [answer.tag for answer in aborted if answer.kind == "%"][-1] == "E0001"
                answers += aborted
            if any(it.error is not None and it.error.severity > 1 for it in answers):
                one.receive(b"99999 ClearAllErrors()")
                assert [parse_answer(text).kind for text in one.pop_lines()] == ["&", "%"], line
        one.receive(b"00001 EndSession()")
        assert one.pop_lines()[-1] == "00001 %"


def test_survives_streams_of_bytes(tmp_path: Path, repeats: Callable[..., int]) -> None:
    rng = random.Random(8)  # noqa: S311 - as above
    with served_station(tmp_path) as served:
        for number in range(repeats(6, 300)):
            with socket.create_connection(served.address) as connection:
                pieces = [b"00001 StartSession()\r\n" if number % 2 else b"", rng.randbytes(3000)]
                pieces += [b"x" * 200_000, b"\n", b"\r", b"\r\n\r\n", b"00002 GetDMEVersion()\n"]
                rng.shuffle(pieces)
                for piece in pieces:
                    connection.sendall(piece)
                if number % 3:
                    connection.shutdown(socket.SHUT_WR)
                    while connection.recv(65_536):
                        pass
            _serves_again(served.address)


def _serves_again(address: tuple[str, int]) -> None:
    """Start a session as soon as the server has noticed that the last client is gone."""
    while True:
        with DmeClient(address) as client:
            try:
                client.good("StartSession()")
            except ConnectionError:
                continue
            client.good("GetDMEVersion()")
            client.good("EndSession()")
            return


def test_answers_a_line_that_is_too_long(tmp_path: Path) -> None:
    with served_station(tmp_path) as served, session(served.address) as client:
        inside = 65_536 - 2 - len('00001 FindTool("")')
        assert client.send_whole(b'00001 FindTool("' + b"a" * inside + b'")') is not None
        client.good("ClearAllErrors()")
        assert client.send_whole(b'00002 FindTool("' + b"a" * (inside + 1) + b'")') is not None
        client.good("ClearAllErrors()")
        # Both were answered once, so the next command gets its own answer.
        client.good("GetDMEVersion()")


def test_queues_commands_behind_one_that_waits(tmp_path: Path) -> None:
    with served_station(tmp_path) as served, session(served.address) as client:
        client.good("Home()")
        client.good('ChangeTool("standard")')
        first = client.start("PtMeas(X(0), Y(0), Z(0), IJK(0, 0, 1))")
        second = client.start("GetCoordSystem()")
        fast = client.call("GetErrStatusE()")
        assert fast.done
        client.finish(second)
        # Results leave in the order of the commands: the client checks it.
        assert first.done
        assert np.isfinite([value[0] for value in first.values().values()]).all()
