"""A real Dask scheduler and workers on free ports of this computer."""

from __future__ import annotations

import contextlib
import datetime
import ipaddress
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from ocmm_core.cluster import Site

if TYPE_CHECKING:
    from distributed import Client

NO_PAGE = ("--preload", "ocmm_shop.cluster.no_page")
"""As the units of `installer/linux` have it: no HTTP server."""
ROOT = Path(__file__).resolve().parents[1]
HANG_S = 240.0
NO_PROFILE = "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED"
"""As the units of `installer/linux` set it: a sample of every thread each 10 ms costs a scheduler
more than the tasks."""


class ShopCluster:
    """Separate processes, as started by systemd; removed at the end.

    Parameters
    ----------
    folder
        For the workers' files.
    certificates
        Folder with ``ca.pem``, ``cert.pem`` and ``key.pem``; None: without TLS.
    """

    def __init__(self, folder: Path, certificates: Path | None = None) -> None:
        self._folder = folder
        self._tls = [] if certificates is None else [
            "--tls-ca-file", str(certificates / "ca.pem"),
            "--tls-cert", str(certificates / "cert.pem"),
            "--tls-key", str(certificates / "key.pem"),
        ]  # fmt: skip
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        kind = "tcp" if certificates is None else "tls"
        self.address = f"{kind}://127.0.0.1:{self.port}"
        files = (None,) * 3 if certificates is None else tuple(
            certificates / name for name in ("ca.pem", "cert.pem", "key.pem")
        )  # fmt: skip
        self.site = Site(self.address, None, *files)
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> None:
        """Start it and wait until it answers."""
        self.scheduler = self._run(
            "scheduler", "--host", self.address.rpartition(":")[0], "--port", str(self.port),
            "--no-dashboard", *NO_PAGE,
        )  # fmt: skip
        until = time.monotonic() + HANG_S
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port)):
                return
            assert self.scheduler.poll() is None
            assert time.monotonic() < until
            time.sleep(0.05)

    def start_worker(
        self, *more: str, environment: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a worker; it is not waited for."""
        worker = self._run(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
            *NO_PAGE, "--memory-limit", "0", "--local-directory", str(self._folder), *more,
            environment=environment,
        )  # fmt: skip
        self.workers.append(worker)
        return worker

    def wait_for(self, workers: int) -> None:
        """Wait for the given number of workers."""
        with self.client() as client:
            client.wait_for_workers(workers, timeout=HANG_S)

    def client(self) -> Client:
        """Return a client of the scheduler, with the certificate of the shop if available."""
        from distributed import Client
        from distributed.security import Security

        security = None
        if self.site.ca is not None:
            security = Security(
                tls_ca_file=str(self.site.ca), tls_client_cert=str(self.site.cert),
                tls_client_key=str(self.site.key), require_encryption=True,
            )  # fmt: skip
        return Client(self.address, security=security, set_as_default=False)

    def _run(
        self, what: str, *arguments: str, environment: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        whole = os.environ | {
            "PYTHONPATH": str(ROOT),
            "OPENBLAS_NUM_THREADS": "1",
            NO_PROFILE: "False",
        } | dict(environment or {})  # fmt: skip
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments, *self._tls]
        with (self._folder / f"{what}.log").open("ab") as log:
            return subprocess.Popen(  # noqa: S603 - our own interpreter
                command, stdout=log, stderr=log, env=whole
            )

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a process at once."""
        process.send_signal(signal.SIGKILL)
        process.wait()
        if process in self.workers:
            self.workers.remove(process)

    def close(self) -> None:
        """End everything."""
        for process in [*self.workers, *([self.scheduler] if self.scheduler else [])]:
            self.kill(process)
        self.scheduler = None


def make_certificates(folder: Path) -> Path:
    """Write a CA of the tests, and a certificate with its key that it signed."""
    folder.mkdir()
    now = datetime.datetime.now(datetime.UTC)
    keys = [ec.generate_private_key(ec.SECP256R1()) for _ in range(2)]
    names = [
        x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)]) for text in ("shop CA", "shop")
    ]
    for name, place in (("ca.pem", 0), ("cert.pem", 1)):
        made = (
            x509.CertificateBuilder()
            .subject_name(names[place])
            .issuer_name(names[0])
            .public_key(keys[place].public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(days=1))
            .not_valid_after(now + datetime.timedelta(days=1))
            .add_extension(x509.BasicConstraints(ca=place == 0, path_length=None), critical=True)
            .add_extension(
                x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]),
                critical=False,
            )
            .sign(keys[0], hashes.SHA256())
        )
        (folder / name).write_bytes(made.public_bytes(serialization.Encoding.PEM))
    (folder / "key.pem").write_bytes(
        keys[1].private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return folder


def spent_s(process: subprocess.Popen[bytes] | None) -> float:
    """Return the processor time that a process has taken so far; of this one for None, s."""
    if process is None:
        return time.process_time()
    words = Path("/proc", str(process.pid), "stat").read_text(encoding="ascii").rsplit(")", 1)[1]
    return sum(map(int, words.split()[11:13])) / os.sysconf("SC_CLK_TCK")


def wait_a_second(thing: int) -> int:
    """Take a second; workers import it by its name."""
    time.sleep(1.0)
    return thing
