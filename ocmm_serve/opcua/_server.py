"""The OPC UA server: certificates of clients, permitted addresses, bounded connections."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Iterable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from asyncua import Server, ua
from asyncua.common.connection import TransportLimits
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import SimpleRoleRuleset, User, UserRole
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from cryptography import x509

from ocmm_core.documents import files_of_folder, read_bytes
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.station.stream import StreamOptions, listen, may_connect
from ocmm_serve.opcua._model import NAMESPACE, MachineModel
from ocmm_serve.published import PublishedFacts

_POLICIES = [
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Basic256Sha256_Sign,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_Sign,
]
_MOST_CLIENTS = 16
_HANDSHAKE_S = 10.0
_MOST_BYTES = 4 * 1024 * 1024
"""Limit for a request, and for unread answers; more disconnects the client."""
_WRITE: Any = ua.NodeId(ua.Int32(ua.ObjectIds.WriteRequest_Encoding_DefaultBinary))
_LIMITS = TransportLimits(65535, 65535, 64, _MOST_BYTES)
_LOOK_S = 0.1
_CLOSE_S = 10.0


class TrustedClients:
    """Permitted clients by their certificates: the user manager of the library.

    `anonymous`: clients without a certificate may read also. InputError: a file of the folder is
    no certificate.
    """

    def __init__(self, folder: Path | None, *, anonymous: bool) -> None:
        self.anonymous = anonymous
        if folder is not None and not folder.is_dir():
            raise InputError(
                "opcua.trusted", f"{folder}: this is not a folder.", "Correct --trusted."
            )
        files = [] if folder is None else files_of_folder(folder, "")
        self._trusted = {_certificate(read_bytes(path), path) for path in files}
        self.refused = 0

    def get_user(
        self, iserver: InternalServer, username: str | None = None, password: str | None = None,
        certificate: Any = None,
    ) -> User | None:  # fmt: skip
        """Return the role of a client; None refuses it."""
        if certificate:
            accepted = self._wrong(x509.load_der_x509_certificate(certificate)) is None
        else:
            accepted = self.anonymous
        if accepted:
            return User(UserRole.User)
        self.refused += 1
        return None

    async def validate(self, certificate: x509.Certificate, _: ua.ApplicationDescription) -> None:
        """Raise the error of the protocol for a certificate that is not accepted."""
        wrong = self._wrong(certificate)
        if wrong is not None:
            self.refused += 1
            raise ServiceError(wrong)

    def _wrong(self, certificate: x509.Certificate) -> int | None:
        now = datetime.now(UTC)
        if not certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc:
            return ua.StatusCodes.BadCertificateTimeInvalid
        trusted = self.anonymous or certificate in self._trusted
        return None if trusted else ua.StatusCodes.BadCertificateUntrusted


def _certificate(content: bytes, path: Path) -> x509.Certificate:
    try:
        pem = content.lstrip().startswith(b"-----")
        return (x509.load_pem_x509_certificate if pem else x509.load_der_x509_certificate)(content)
    except ValueError as error:
        raise InputError(
            "opcua.certificate",
            f"{path}: this is not a certificate ({error}).",
            "Keep only certificates of clients in this folder, as PEM or DER files.",
        ) from error


class _ReadOnly(SimpleRoleRuleset):
    """Rules of the library without writing: some members of the nodesets are writable."""

    def check_validity(self, user: User, action_type_id: ua.NodeId, body: Any) -> bool:
        allowed: bool = super().check_validity(user, action_type_id, body)
        return allowed and action_type_id != _WRITE


class _Connection(OPCUAProtocol):
    """A connection of a permitted address, disconnected before it holds much memory."""

    def __init__(self, options: StreamOptions, *own: Any) -> None:
        super().__init__(*own)
        self._options = options

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if may_connect(self._options, str(transport.get_extra_info("peername")[0])):
            super().connection_made(transport)
        else:
            transport.close()

    def data_received(self, data: bytes) -> None:
        transport = self.transport
        if transport is None:
            return
        unread = transport.get_write_buffer_size()
        if max(len(self._buffer) + len(data), unread) > _MOST_BYTES:
            transport.abort()
        else:
            super().data_received(data)


class _Listener(BinaryServer):
    def __init__(self, iserver: InternalServer, listener: socket.socket, options: StreamOptions):
        host, port = listener.getsockname()[:2]
        super().__init__(iserver, host, port, _LIMITS)
        self._socket, self._options = listener, options

    async def start(self) -> None:
        make = partial(
            _Connection, self._options, self.iserver, self._policies, self.clients,
            self.closing_tasks, self.limits,
        )  # fmt: skip
        self._server = await asyncio.get_running_loop().create_server(make, sock=self._socket)
        self.cleanup_task = asyncio.create_task(self._close_task_loop())


class _BoundedServer(Server):
    """The server of the library on a listening socket, with small limits."""

    def __init__(
        self, listener: socket.socket, options: StreamOptions, clients: TrustedClients
    ) -> None:
        super().__init__(user_manager=clients)  # type: ignore[arg-type] # by its methods
        self._socket, self._options = listener, options
        inner = self.iserver
        inner.allow_remote_admin = False
        # The certificate of the application identifies a client, not a second one of a user.
        self.set_identity_tokens([ua.AnonymousIdentityToken])
        inner.certificate_validator = clients.validate
        inner.max_connections, inner.max_pending_activation_seconds = _MOST_CLIENTS, _HANDSHAKE_S
        inner.max_subscriptions = 64
        inner.max_monitored_item_queue_size = inner.max_unacked_messages_per_subscription = 64

    async def start(self) -> None:
        await self._setup_server_nodes()
        await self.iserver.start()
        self.bserver = _Listener(self.iserver, self._socket, self._options)
        self.bserver.set_policies(self._policies)
        await self.bserver.start()


class OpcUaServer:
    """Serve facts on a separate thread. MeasuringError: the address is unavailable."""

    def __init__(
        self, clients: TrustedClients, options: StreamOptions, machine: str, serial: str
    ) -> None:
        self._clients, self._options = clients, options
        self._machine, self._serial = machine, serial
        self._facts = PublishedFacts()
        self._stopping, self._ready = threading.Event(), threading.Event()
        self._failure: Exception | None = None
        self._listener = listen(options, _MOST_CLIENTS)
        self._thread = threading.Thread(target=self._run, name="ocmm-opcua")
        self.missed = 0
        """Versions of the facts that were replaced before clients could read them."""
        host, port = self._listener.getsockname()[:2]
        self.address = f"opc.tcp://{f'[{host}]' if ':' in host else host}:{port}/ocmm"

    def start(self) -> None:
        """Serve, and return as soon as clients can connect."""
        # Faults of clients are counted; their tracebacks are not for operators.
        for library in ("asyncua", "asyncio"):
            logging.getLogger(library).setLevel(logging.CRITICAL + 1)
        self._thread.start()
        self._ready.wait()

    def show(self, facts: PublishedFacts) -> None:
        """Show facts as soon as possible; raise the error that ended the server."""
        self._facts = facts
        if self._failure is not None:
            raise contained(self._failure, "The OPC UA server")

    def close(self) -> None:
        """Disconnect all clients, and end."""
        self._stopping.set()
        self._thread.join(_CLOSE_S)

    def _run(self) -> None:
        try:
            with contextlib.closing(self._listener):
                asyncio.run(self._serve())
        except Exception as error:
            self._failure = error
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        options = self._options
        server = _BoundedServer(self._listener, options, self._clients)
        await server.init()
        server.set_server_name("OCMM")
        server.set_endpoint(self.address)
        policies, uri = [], NAMESPACE
        if options.certificate is not None and options.private_key is not None:
            own = read_bytes(options.certificate)
            uri = next(iter(_uris(_certificate(own, options.certificate))), NAMESPACE)
            await server.load_certificate(own, "pem")
            await server.load_private_key(read_bytes(options.private_key), format="pem")
            policies = list(_POLICIES)
        await server.set_application_uri(uri)
        if self._clients.anonymous:
            policies.append(ua.SecurityPolicyType.NoSecurity)
        server.set_security_policy(policies, _ReadOnly())
        model = MachineModel(server)
        names = quote(self._machine), quote(self._serial)
        await model.build(self._machine, self._serial, ":".join(("urn:ocmm", *names)))
        version = 0
        async with server:
            self._ready.set()
            while not self._stopping.is_set():
                facts = self._facts
                if facts.version != version:
                    self.missed += facts.version - version - 1
                    version = facts.version
                    await model.show(facts)
                await asyncio.sleep(_LOOK_S)


def _uris(certificate: x509.Certificate) -> Iterable[str]:
    with contextlib.suppress(x509.ExtensionNotFound):
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
        return names.value.get_values_for_type(x509.UniformResourceIdentifier)
    return ()
