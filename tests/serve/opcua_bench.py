"""OPC UA server of the product in a process, certificates, and clients of two makers."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID

from tests.host import HANG_S, needs_package, not_run
from tests.serve.ippdme_server import ServedProcess

NODE = Path(__file__).with_name("node")
CLIENT_URI = "urn:ocmm:test"


Pair = tuple[Path, Path]
"""Certificate and key."""


@dataclass(frozen=True, slots=True)
class Access:
    """Certificates of a server and of a client that it trusts."""

    server: Pair
    client: Pair
    trusted: Path
    """Folder with those of the permitted clients."""

    @property
    def options(self) -> tuple[str | Path, ...]:
        """Return the options of the server."""
        return "--cert", self.server[0], "--key", self.server[1], "--trusted", self.trusted


def certificate(
    folder: Path, name: str, uri: str = CLIENT_URI, *, first: int = -1, last: int = 30,
    trusted: Path | None = None,
) -> Pair:  # fmt: skip
    """Make a certificate and its key; `first`, `last`: days from now. `trusted`: copied there."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now + timedelta(days=first))
        .not_valid_after(now + timedelta(days=last))
        .add_extension(
            x509.SubjectAlternativeName([x509.UniformResourceIdentifier(uri)]), critical=False
        )
        .sign(key, hashes.SHA256())
    )
    paths = folder / f"{name}.pem", folder / f"{name}.key.pem"
    paths[0].write_bytes(made.public_bytes(serialization.Encoding.PEM))
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )  # fmt: skip
    paths[1].chmod(0o600)
    if trusted is not None:
        shutil.copy(paths[0], trusted)
    return paths


@contextmanager
def served_opcua(jobs: Path, *options: str | Path) -> Iterator[ServedProcess]:
    """Serve the jobs of a folder until the end of the block; it must end well."""
    needs_package("asyncua", "extra `opcua`")
    server = ServedProcess("opcua", jobs, "--port", "0", *map(str, options))
    try:
        yield server
    finally:
        code = server.stop()
    assert code == 0, server.text
    assert "Traceback" not in server.text, server.text


def url_of(server: ServedProcess) -> str:
    return "opc.tcp://{}:{}/ocmm".format(*server.address)


@asynccontextmanager
async def opcua_client(server: ServedProcess, secured: Pair | None = None) -> Any:
    """Connect asyncua's own client; `secured`: certificate and key."""
    from asyncua import Client, ua
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

    # It would disconnect itself if a busy computer delays an answer for a second.
    client = Client(url_of(server), timeout=HANG_S, watchdog_intervall=HANG_S)
    client.application_uri = CLIENT_URI
    if secured is not None:
        own, key = map(str, secured)
        await client.set_security(SecurityPolicyBasic256Sha256, own, key)
    async with client:
        await client.load_data_type_definitions()
        # Its importer forgets that this field is a whole structure (docs/integrator/opcua.md).
        cast("Any", ua).ResultDataType.__annotations__["ResultMetaData"] = ua.ExtensionObject
        yield client


async def children(client: Any, *path: str) -> dict[str, Any]:
    """Return the nodes below the machine at a path of names, by name."""
    space = await client.get_namespace_index("urn:ocmm:station")
    node = client.get_node(f"ns={space};s=Machine")
    for name in path:
        node = (await _named(node))[name]
    return await _named(node)


async def _named(node: Any) -> dict[str, Any]:
    return {(await one.read_browse_name()).Name: one for one in await node.get_children()}


def node_client(server: ServedProcess, *secured: Path) -> dict[str, Any]:
    """Return everything that node-opcua reads below the machine."""
    if shutil.which("node") is None:
        not_run("'node' is not installed")
    if not (NODE / "node_modules" / "node-opcua-client").exists():
        not_run("node-opcua-client is not installed (npm ci --prefix tests/serve/node)")
    done = subprocess.run(
        ["node", "--security-revert=CVE-2023-46809", "read_station.js", url_of(server),
         *map(str, secured)],
        cwd=NODE, capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "NODEOPCUA_LOG_LEVEL": "ERROR"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    tree: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return tree


def below(tree: dict[str, Any], *path: str) -> Any:
    """Return the nodes at a path of names in a tree of `node_client`."""
    for name in path:
        tree = tree[name]["below"]
    return tree


RESULTS: Sequence[str] = ("MachineryBuildingBlocks", "ResultManagement", "Results")
