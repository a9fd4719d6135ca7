"""Hostile clients of the second screen: paths, sizes, tokens, frames, and too many of them."""

from __future__ import annotations

import http.client
import json
import random
import socket
import ssl
import string
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from ocmm_core.composition import stream_options
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.station.stream import StreamOptions, may_connect
from ocmm_serve.screen._access import MOST_UNDECIDED
from tests.core.station.test_stream_attacks import make_certificate
from tests.host import HANG_S
from tests.serve.second_screen import SECRET, ServedScreen, reading, served_screen

FILES = {"/", "/screen.css", "/screen.js"}


@pytest.fixture
def screen(tmp_path: Path) -> Iterator[ServedScreen]:
    """Return a job that has not begun, with buttons."""
    with served_screen(tmp_path, measured=False) as served:
        yield served


def asked(
    screen: ServedScreen, path: str, method: str = "GET", **headers: str
) -> http.client.HTTPResponse:
    """Return the answer to a request, read."""
    with closing(http.client.HTTPConnection(*screen.server.address, timeout=HANG_S)) as connection:
        connection.putrequest(method, path, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        answer.read()
        return answer


def works(screen: ServedScreen) -> bool:
    with reading(screen, screen.access.read_token) as page:
        return bool(page.current()["features"])


def said(screen: ServedScreen, content: bytes) -> bytes:
    """Return the first line that raw bytes are answered with."""
    with socket.create_connection(screen.server.address, HANG_S) as connection:
        connection.sendall(content)
        with suppress(ConnectionResetError):
            return connection.recv(64).partition(b"\r\n")[0]
    return b""


def talk_until_closed(talk: Connection, message: str | bytes) -> None:
    """Send a message and read until the server closes."""
    talk.send(message)
    while True:
        talk.recv(HANG_S)


def test_serves_its_files_and_nothing_else(
    screen: ServedScreen, repeats: Callable[..., int]
) -> None:
    rng = random.Random(3)  # noqa: S311 - requests that can be repeated
    for path in FILES:
        answer = asked(screen, path)
        assert answer.status == 200
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert answer.headers["Server"] == "OCMM"
    parts = ["..", "%2e%2e", ".", "screen.js", "etc", "passwd", "index.html", "", "\\", "%00",
             "live", "picture", "?", "a" * 200]  # fmt: skip
    for _ in range(repeats(150, 5000)):
        path = "/" + "/".join(rng.choice(parts) for _ in range(rng.randrange(1, 6)))
        with suppress(http.client.InvalidURL):
            status = asked(screen, path).status
            assert status in (400, 403, 404, 405) or path.partition("?")[0] in FILES, path
    for method in ("POST", "PUT", "DELETE", "TRACE", "OPTIONS"):
        assert asked(screen, "/", method).status == 405
    assert works(screen)


def test_pictures_need_the_token_and_are_those_of_the_plan(tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    text = resource("plans", "quick.toml").read_text("utf-8")
    plan.write_text(text.replace('name = "BED"\n', 'name = "BED"\npicture = "bed.png"\n'), "utf-8")
    picture = b"\x89PNG\r\n\x1a\n" + bytes(100)
    (tmp_path / "bed.png").write_bytes(picture)
    with served_screen(tmp_path, plan, measured=False) as screen:
        allowed = {"Authorization": f"Bearer {screen.access.read_token}"}
        assert asked(screen, "/picture?feature=BED").status == 403
        assert asked(screen, "/picture?feature=BED", Authorization="Bearer x").status == 403
        answer = asked(screen, "/picture?feature=BED", **allowed)
        assert answer.status == 200
        assert answer.headers["Content-Type"] == "image/png"
        assert answer.headers["Content-Length"] == str(len(picture))
        for name in ("SPHERE", "../plan.toml", "bed.png", "", "%00"):
            assert asked(screen, f"/picture?feature={name}", **allowed).status == 404
        (tmp_path / "bed.png").unlink()
        assert asked(screen, "/picture?feature=BED", **allowed).status == 404
        with reading(screen, SECRET) as page:
            assert page.current()["picture"] == "BED"


def test_answers_or_ends_whatever_bytes_arrive(
    screen: ServedScreen, repeats: Callable[..., int]
) -> None:
    rng = random.Random(5)  # noqa: S311 - as above
    start = (
        b"GET /live HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )
    for _ in range(repeats(150, 10_000)):
        spoiled = bytearray(start)
        for _ in range(rng.randrange(1, 6)):
            spoiled[rng.randrange(len(spoiled))] = rng.randrange(256)
        first = said(screen, bytes(spoiled) + b"\r\n\r\n" + rng.randbytes(rng.randrange(300)))
        assert first == b"" or first.startswith((b"HTTP/1.1 4", b"HTTP/1.1 101", b"HTTP/1.0 4"))
    assert said(screen, b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n")[:10] in (
        b"HTTP/1.0 4",
        b"HTTP/1.1 4",
    )
    assert said(
        screen, b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9999999\r\n\r\n"
    ).startswith(b"HTTP/1.1 405")
    assert works(screen)


def test_ends_pages_that_break_the_protocol(
    screen: ServedScreen, repeats: Callable[..., int]
) -> None:
    rng = random.Random(7)  # noqa: S311 - as above
    address = f"ws://127.0.0.1:{screen.server.address[1]}/live"
    hello = json.dumps({"token": SECRET})
    hostile: list[str | bytes] = [
        b"\x00" * 20, "x" * 5000, "[" * 2000, "{}" * 3, '{"seen": 1e400}', '{"seen": "1"}',
        '{"do": "take", "id": 99999999999999999999999}', '{"do": ["take"]}', '{"other": 1}', "null",
        '{"seen": true}', "\ud7ff",
    ]  # fmt: skip
    for first in (True, False):
        for message in hostile:
            with connect(address, compression=None) as talk:
                if not first:
                    talk.send(hello)
                    talk.recv(HANG_S)
                with pytest.raises(ConnectionClosed):
                    talk_until_closed(talk, message)
    for _ in range(repeats(40, 2000)):
        token = "".join(rng.choices(string.printable, k=rng.randrange(60)))
        with connect(address, compression=None) as talk:
            talk.send(json.dumps({"token": token}))
            with pytest.raises(ConnectionClosed):
                talk.recv(HANG_S)
    # Acknowledgements of later snapshots have no effect.
    with reading(screen, SECRET) as page:
        page.talk.send(json.dumps({"seen": 10**9}))
        number = page.next()["number"]
        assert page.next()["number"] == number + 1
    assert works(screen)


def test_silent_connections_shut_nobody_out(screen: ServedScreen) -> None:
    with ExitStack() as stack:
        silent = [
            stack.enter_context(socket.create_connection(screen.server.address, HANG_S))
            for _ in range(4 * MOST_UNDECIDED)
        ]
        for one in silent[::2]:
            with suppress(OSError):
                one.sendall(b"GET / HTTP/1.1\r\nX: ")
        assert works(screen)
        # The oldest gave way; the last ones end when their time is over.
        ended = 0
        for one in silent:
            with suppress(ConnectionError):
                assert one.recv(1) == b""
            ended += 1
        assert ended == len(silent)


def test_over_tls_the_page_is_the_same(tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    key.chmod(0o600)
    options = stream_options(0, "127.0.0.1", None, certificate, key, ())
    assert options is not None
    trusting = ssl.create_default_context(cafile=str(certificate))
    with served_screen(tmp_path, stream=options) as screen:
        address = f"wss://localhost:{screen.server.address[1]}/live"
        with (
            socket.create_connection(screen.server.address, HANG_S) as plain,
            connect(address, ssl=trusting, sock=socket.create_connection(screen.server.address))
            as talk,
        ):  # fmt: skip
            plain.sendall(b"GET / HTTP/1.1\r\n\r\n")
            talk.send(json.dumps({"token": SECRET}))
            assert json.loads(talk.recv(HANG_S))["controls"] is True


def test_other_computers_need_the_allow_list(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Any computer that reaches 0\.0\.0\.0"):
        stream_options(0, "0.0.0.0", None, allow=())  # noqa: S104 - refused
    network = StreamOptions(host="192.168.1.20", allow=("192.168.1.0/24",))
    assert may_connect(network, "192.168.1.31")
    assert not may_connect(network, "192.168.2.31")
    expired = make_certificate(tmp_path, days=-1)
    with pytest.raises(InputError, match="valid from"):
        stream_options(0, "127.0.0.1", None, *expired, ())
