"""Access to the OPC UA server: certificates, addresses, read-only, garbage."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_serve.site import require_package
from tests.commands import Ocmm
from tests.host import HANG_S, needs_package
from tests.serve.ippdme_server import ServedProcess
from tests.serve.opcua_bench import (
    Pair,
    certificate,
    children,
    node_client,
    opcua_client,
    served_opcua,
    url_of,
)

GARBAGE = 1000


@dataclass(frozen=True, slots=True)
class Secured:
    """A running server, and clients."""

    server: ServedProcess
    client: Pair
    """That it trusts."""
    stranger: Pair
    expired: Pair
    early: Pair
    """`expired`, `early`: trusted, but no longer or not yet valid."""


@pytest.fixture(scope="module")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secured]:
    needs_package("asyncua", "extra `opcua`")
    folder = tmp_path_factory.mktemp("secured")
    trusted = folder / "trusted"
    trusted.mkdir()
    own = certificate(folder, "server", "urn:ocmm:here")
    client = certificate(folder, "client", trusted=trusted)
    expired = certificate(folder, "expired", first=-30, last=-1, trusted=trusted)
    early = certificate(folder, "early", first=1, trusted=trusted)
    options = "--cert", own[0], "--key", own[1], "--trusted", trusted
    with served_opcua(folder / "jobs", *options) as server:
        yield Secured(server, client, certificate(folder, "stranger"), expired, early)


async def connects(server: ServedProcess, secured: Pair | None) -> str:
    """Return the error of a client that connects; empty if it reads."""
    try:
        async with opcua_client(server, secured) as client:
            await (await children(client, "Station"))["Online"].read_value()
    except Exception as error:
        return type(error).__name__
    return ""


def test_reads_with_a_trusted_certificate_and_refuses_all_others(secured: Secured) -> None:
    server = secured.server
    assert asyncio.run(connects(server, secured.client)) == ""
    assert asyncio.run(connects(server, secured.stranger)) == "BadCertificateUntrusted"
    for one in (secured.expired, secured.early):
        assert asyncio.run(connects(server, one)) == "BadCertificateTimeInvalid"
    # The server offers no connection without a certificate.
    assert asyncio.run(connects(server, None)) == "UaError"


def test_a_session_without_certificate_is_refused_also_if_it_is_forced(secured: Secured) -> None:
    async def force() -> str:
        from asyncua import Client, ua
        from asyncua.ua.uaerrors import UaError

        client = Client(url_of(secured.server), timeout=HANG_S)
        await client.connect_socket()
        await client.send_hello()
        await client.open_secure_channel()
        create, activate = ua.CreateSessionParameters(), ua.ActivateSessionParameters()
        create.EndpointUrl, create.RequestedSessionTimeout = url_of(secured.server), 60000.0
        activate.UserIdentityToken = ua.AnonymousIdentityToken()
        await client.uaclient.create_session(create)
        try:
            await client.uaclient.activate_session(activate)
        except UaError as error:
            return type(error).__name__
        finally:
            client.disconnect_socket()
        return ""

    assert asyncio.run(force()) == "BadUserAccessDenied"


def test_a_client_of_another_maker_is_judged_likewise(secured: Secured) -> None:
    assert node_client(secured.server, *secured.client)["Station"]
    with pytest.raises(AssertionError, match="BadCertificateUntrusted"):
        node_client(secured.server, *secured.stranger)


def test_a_client_that_hides_its_certificate_is_refused(secured: Secured) -> None:
    async def hide(server: ServedProcess) -> str:
        from asyncua import Client
        from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
        from asyncua.ua.uaerrors import UaError

        client = Client(url_of(server), timeout=HANG_S)
        own, key = map(str, secured.stranger)
        await client.set_security(SecurityPolicyBasic256Sha256, own, key)
        create = client.uaclient.create_session

        async def without(parameters: Any) -> Any:
            parameters.ClientCertificate = b""
            return await create(parameters)

        client.uaclient.create_session = without  # type: ignore[method-assign] # a hostile client
        try:
            await client.connect()
        except UaError as error:
            return type(error).__name__
        await client.disconnect()
        return ""

    assert asyncio.run(hide(secured.server)) == "BadUserAccessDenied"


def test_nothing_can_be_written_added_or_deleted(secured: Secured) -> None:
    async def attack(server: ServedProcess) -> list[str]:
        from asyncua import ua
        from asyncua.ua.uaerrors import UaError

        errors = []
        async with opcua_client(server, secured.client) as client:
            delete: Any = client.delete_nodes
            station = await children(client, "Station")
            folder = (await children(client))["Station"]
            for attempt in (
                lambda: station["Online"].write_value(True),
                lambda: folder.add_variable(2, "planted", 1.0),
                lambda: delete([folder]),
                lambda: folder.add_reference(station["Online"], ua.ObjectIds.Organizes),
            ):
                try:
                    await attempt()
                except UaError as error:
                    errors.append(type(error).__name__)
            assert not await station["Online"].read_value()
        return errors

    errors = asyncio.run(attack(secured.server))
    assert len(errors) == 4
    assert set(errors) <= {"BadUserAccessDenied", "BadNotWritable"}


def test_clients_that_send_garbage_change_nothing(secured: Secured) -> None:
    chance = np.random.default_rng(46)
    hello = b"HELF" + (32).to_bytes(4, "little") + bytes(24)
    for number in range(GARBAGE):
        content = chance.bytes(int(chance.integers(1, 3000)))
        start = (b"", hello, b"OPNF", b"MSGF\xff\xff\xff\x7f")[number % 4]
        # Some are refused while others of them are connected.
        with (
            contextlib.suppress(OSError),
            socket.create_connection(secured.server.address, timeout=HANG_S) as client,
        ):
            client.sendall(start + content)
    # The server may still be closing the last of them, and refuses more meanwhile.
    ended = time.monotonic() + HANG_S
    while found := asyncio.run(connects(secured.server, secured.client)):
        assert found == "ConnectionResetError"
        assert time.monotonic() < ended


def test_an_endless_request_is_cut_off(secured: Secured) -> None:
    head = b"MSGF" + (2**31 - 1).to_bytes(4, "little")
    with socket.create_connection(secured.server.address, timeout=HANG_S) as client:
        client.sendall(head)
        # At most 4 MiB are held; the rest is in the buffers of the system.
        with pytest.raises(OSError, match=r"reset|Broken"):
            client.sendall(bytes(64 * 1024 * 1024))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ((), "OPC UA needs a certificate"),
        (("--anonymous", "--host", "192.0.2.1"), "Any computer that reaches 192.0.2.1"),
        (("--cert", "old.pem", "--key", "old.key"), "the certificate is valid from"),
        (("--anonymous", "--trusted", "wrong"), "this is not a certificate"),
        (("--anonymous", "--trusted", "none"), "none"),
    ],
)
def test_refuses_to_start_open_or_without_a_valid_certificate(
    ocmm_here: Ocmm, tmp_path: Path, more: tuple[str, ...], words: str
) -> None:
    needs_package("asyncua", "extra `opcua`")
    certificate(tmp_path, "old", first=-30, last=-1)
    (tmp_path / "wrong").mkdir()
    (tmp_path / "wrong" / "client.pem").write_text("no certificate", encoding="utf-8")
    done = ocmm_here("serve", "opcua", "--port", "0", *more)
    assert done.returncode == 2
    assert words in done.stderr.replace("\n      ", " ")
    assert "Traceback" not in done.stderr


def test_names_a_missing_package_and_its_remedy() -> None:
    with pytest.raises(InputError, match=r"package no_such_package.*--opcua|ocmm\[opcua\]"):
        require_package("no_such_package", "opcua")
