"""Clients without a token cost the stream some places, bytes and seconds, and disturb no other."""

from __future__ import annotations

import datetime as dt
import json
import random
import socket
import ssl
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st

from ocmm_core.composition import StationRequest, build_station, stream_options
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import StreamOptions, StreamServer
from ocmm_core.station.stream._client import LONGEST_REQUEST
from ocmm_core.station.stream._messages import read_request
from ocmm_core.station.stream._reception import MOST_UNDECIDED
from tests.host import HANG_S, on_linux_only

TOKEN = "0123456789abcdef-token"  # noqa: S105 - of a test
CORPUS = Path(__file__).with_name("stream_requests.txt")
"""Requests that ended the stream once, and their like: bytes as Python writes them."""


@pytest.fixture
def station(tmp_path: Path) -> Iterator[MeasuringStation]:
    """Return the quick plan on the virtual rig, not begun yet."""
    plan = resource("plans", "quick.toml")
    built = build_station(StationRequest(plan=plan, out=tmp_path, frame_rate_hz=500)).station
    yield built
    built.close()


def connect(address: tuple[str, int]) -> socket.socket:
    made = socket.create_connection(address, timeout=HANG_S)
    made.settimeout(HANG_S)
    return made


def answer(address: tuple[str, int], said: bytes) -> str:
    """Return what kind of line follows the greeting."""
    with closing(connect(address)) as client, client.makefile("rb") as lines:
        assert json.loads(lines.readline())["type"] == "hello"
        with suppress(OSError):
            client.sendall(said)
        with suppress(OSError):
            return str(json.loads(lines.readline())["type"])
    return "gone"


def corpus() -> list[bytes]:
    lines = CORPUS.read_text("ascii").splitlines()
    return [line.encode("ascii").decode("unicode_escape").encode("latin-1") for line in lines]


def test_no_request_ends_the_stream(station: MeasuringStation) -> None:
    failures: list[Exception] = []
    with StreamServer(station, StreamOptions(token=TOKEN), failures.append) as server:
        for said in corpus():
            assert answer(server.address, said + b"\n") in ("bye", "gone")
        good = json.dumps({"token": TOKEN}).encode() + b"\n"
        assert answer(server.address, good) == "status"
    assert failures == []


@given(st.binary(max_size=200))
def test_whatever_is_said_is_a_request_or_a_sentence(said: bytes) -> None:
    with suppress(InputError):
        read_request(said)


def test_mutated_requests_are_requests_or_sentences() -> None:
    rng = random.Random(1)  # noqa: S311 - a test
    samples = [*corpus(), b'{"resume": 41, "token": "0123456789abcdef", "poses": false}']
    for _ in range(20_000):
        said = bytearray(rng.choice(samples))
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(said) + 1)
            said[at : at + rng.randint(0, 3)] = rng.randbytes(rng.randint(0, 3))
        with suppress(InputError):
            read_request(bytes(said))


def test_silent_connections_shut_nobody_out(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions(token=TOKEN)) as server:
        silent = [connect(server.address) for _ in range(3 * MOST_UNDECIDED)]
        good = json.dumps({"token": TOKEN}).encode() + b"\n"
        with closing(connect(server.address)) as client, client.makefile("rb") as lines:
            client.sendall(good)
            assert json.loads(lines.readline())["type"] == "hello"
            assert json.loads(lines.readline())["type"] == "status"
            # More of them change nothing for who is in.
            silent += [connect(server.address) for _ in range(3 * MOST_UNDECIDED)]
            for _ in range(20):
                assert json.loads(lines.readline())["type"] != "bye"
        gone = 0
        for one in silent:
            one.settimeout(0.0)
            with suppress(BlockingIOError), one.makefile("rb") as lines:
                told = one.recv(65536)
                gone += b"too many connections wait" in told or not told
            one.close()
        assert gone >= len(silent) - MOST_UNDECIDED - 1


def test_who_talks_too_much_is_cut_off(station: MeasuringStation) -> None:
    with StreamServer(station, StreamOptions()) as server:
        # Before the request there is a longest line; behind it there is nothing to say.
        assert answer(server.address, b"x" * (LONGEST_REQUEST + 10)) == "bye"
        with closing(connect(server.address)) as client:
            client.sendall(b"\n")
            ended = False
            # It must be cut off while it sends: a resting station sends nothing for which a client
            # could wait.
            client.settimeout(0.05)
            until = time.monotonic() + HANG_S
            while not ended and time.monotonic() < until:
                try:
                    client.sendall(b"y" * 65536)
                    ended = client.recv(65536) == b""
                except TimeoutError:
                    continue
                except OSError:
                    ended = True
            assert ended
        assert answer(server.address, b"\n") == "status"


def make_certificate(folder: Path, *, days: int = 10, name: str = "localhost") -> tuple[Path, Path]:
    """Return a self-signed certificate and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = dt.datetime.now(dt.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject).issuer_name(subject).public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - dt.timedelta(days=20))
        .not_valid_after(now + dt.timedelta(days=days))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .sign(key, hashes.SHA256())
    )  # fmt: skip
    certificate, private = folder / f"{name}-{days}.pem", folder / f"{name}-{days}.key"
    certificate.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    private.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return certificate, private


def test_over_tls_the_same_is_told_and_half_a_handshake_costs_nobody(
    station: MeasuringStation, tmp_path: Path
) -> None:
    certificate, private = make_certificate(tmp_path)
    options = StreamOptions(token=TOKEN, certificate=certificate, private_key=private)
    failures: list[Exception] = []
    with StreamServer(station, options, failures.append) as server:
        halves = [connect(server.address) for _ in range(2 * MOST_UNDECIDED)]
        for half in halves[::2]:
            half.sendall(b"\x16\x03\x01\x02\x00")
        # Who does not speak TLS learns nothing.
        with closing(connect(server.address)) as plain:
            plain.sendall(b'{"resume": 0}\n')
            assert b"stream" not in plain.recv(65536)
        context = ssl.create_default_context(cafile=str(certificate))
        with (
            closing(connect(server.address)) as raw,
            context.wrap_socket(raw, server_hostname="localhost") as client,
            client.makefile("rb") as lines,
        ):
            assert client.version() in ("TLSv1.2", "TLSv1.3")
            client.sendall(json.dumps({"token": TOKEN}).encode() + b"\n")
            assert json.loads(lines.readline())["type"] == "hello"
            assert json.loads(lines.readline())["type"] == "status"
        for half in halves:
            half.close()
    assert failures == []


def test_files_that_cannot_be_used_for_tls_are_named(tmp_path: Path) -> None:
    certificate, private = make_certificate(tmp_path)
    _, other = make_certificate(tmp_path, name="elsewhere")
    old, old_key = make_certificate(tmp_path, days=-5)
    text = tmp_path / "text.pem"
    text.write_text("no certificate")
    for given_files, words in (
        ((certificate, None), "both a certificate and its private key"),
        ((None, private), "both a certificate and its private key"),
        ((tmp_path / "x.pem", private), "file not found"),
        ((certificate, tmp_path / "x.key"), "file not found"),
        ((text, private), "this is not a certificate"),
        ((certificate, other), "cannot be used for TLS"),
        ((certificate, text), "cannot be used for TLS"),
        ((old, old_key), "the certificate is valid from"),
    ):
        with pytest.raises(InputError, match=words):
            stream_options(0, "127.0.0.1", None, *given_files)


@on_linux_only
def test_a_token_that_others_can_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "token.txt"
    path.write_text(TOKEN)
    path.chmod(0o640)
    with pytest.raises(InputError, match="other users of this computer can read") as caught:
        stream_options(0, "127.0.0.1", path)
    assert caught.value.remedy.startswith(f"Type chmod 600 {path}")
    path.chmod(0o600)
    options = stream_options(0, "127.0.0.1", path)
    assert options is not None
    assert options.token == TOKEN


@on_linux_only
def test_a_key_of_the_certificate_that_everybody_can_read_is_refused(tmp_path: Path) -> None:
    certificate, private = make_certificate(tmp_path)
    private.chmod(0o644)
    with pytest.raises(InputError, match="can read the key of the certificate") as caught:
        stream_options(0, "127.0.0.1", None, certificate, private)
    assert caught.value.code == "stream.key_open"
    # A group for the keys of certificates is usual.
    private.chmod(0o640)
    assert stream_options(0, "127.0.0.1", None, certificate, private) is not None


def test_who_talks_and_reads_nothing_is_cut_off(station: MeasuringStation) -> None:
    with (
        StreamServer(station, StreamOptions()) as server,
        closing(connect(server.address)) as client,
    ):
        client.sendall(b"\n")
        client.settimeout(0.2)
        until = time.monotonic() + HANG_S
        with suppress(ConnectionError):
            while time.monotonic() < until:
                with suppress(TimeoutError):
                    client.sendall(b"y" * 1_000_000)
        assert time.monotonic() < until
