"""Malformed and hostile messages to a scheduler and its workers: what comes of them.

One message is one connection. Without rights: bytes in the clear, a whole conversation in the clear
or by a certificate that the CA of the shop did not sign, each asking for a program to be run. With
a certificate of the CA: sizes up to 2**64, frames that do not fit together, greetings and requests
of wrong kinds, pickles that are broken. After each kind the same tasks are done as before: an
effect is another digit, a program that ran, a worker more or fewer, or a process that ended.
Printed are how many messages there were of each kind, effects, how much the processes grew, and how
long it took.

At the end the same request is made once with a certificate of the CA: that runs the program
(`docs/integrator/cluster.md`). It shows that the requests before could have had an effect.

Run: ``python -m benchmarks.cluster_attack [--messages 10000]``.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import socket
import ssl
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from distributed.protocol import dumps
from distributed.protocol import pickle as packing
from distributed.protocol.utils import pack_frames

from benchmarks.cluster_processes import ShopCluster, make_certificates
from ocmm_core.cluster import run_tasks

KINDS = (
    "bytes in the clear", "conversation in the clear", "no certificate", "certificate of others",
    "sizes", "frames", "greetings", "requests", "broken pickles",
)  # fmt: skip
_PATIENCE_S = 0.02
"""Waiting time for an answer: malformed messages often get none."""
_SEEDS = np.random.SeedSequence(22).spawn(8)
_GREETING = {"compression": None, "python": (3, 11, 0), "pickle-protocol": 5}
_WRONG: tuple[object, ...] = (
    None, True, -1, 1 << 62, 1.5, float("nan"), "x" * 2000, b"\x80\x05.", [], {}, [[[]]], {"a": 1},
)  # fmt: skip
_OPERATIONS = (
    "gather", "scatter", "update-graph", "register-client", "register-worker", "heartbeat_worker",
    "heartbeat-client", "who_has", "has_what", "get_data", "broadcast", "proxy", "rebalance",
    "replicate", "missing_workers", "add_keys", "collections", "stream-start", "nothing", "",
    "__class__", "free-keys", "compute-task", "get_runspec", "client-releases-keys",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Effects:
    """What came of the messages of one kind."""

    kind: str
    messages: int
    found: tuple[str, ...]
    grown_mb: float
    seconds: float


def framed(message: object) -> bytes:
    """Return a message as Dask writes it on a connection."""
    packed = bytes(pack_frames(dumps(message)))
    return struct.pack("Q", len(packed)) + packed


def program(marker: Path) -> bytes:
    """Return a request for a program to be run, whose effect is a file."""
    made = {
        "op": "run_function" if marker.name == "scheduler" else "run",
        "function": packing.dumps(partial(os.mknod, str(marker))),
        "args": packing.dumps(()), "kwargs": packing.dumps({}), "reply": True,
    }  # fmt: skip
    return framed(made)


class Attacker:
    """Sends messages in turn.

    Parameters
    ----------
    folder
        For files left by executed programs.
    own, others
        Certificates of the CA of the shop, and of a foreign one.
    """

    def __init__(self, folder: Path, own: Path, others: Path, seed: int = 22) -> None:
        self._folder = folder
        self._rng = random.Random(seed)  # noqa: S311 - a benchmark
        self._contexts = {
            "no certificate": _context(None), "certificate of others": _context(others),
        }  # fmt: skip
        self._own = _context(own)

    @property
    def markers(self) -> list[str]:
        """Return what programs that ran have left."""
        return [one.name for one in self._folder.iterdir()]

    def send(self, kind: str, port: int, part: str) -> None:
        """Send one message of a kind, and receive for a moment."""
        request = program(self._folder / part)
        if kind == "bytes in the clear":
            _talk(port, None, self._bytes(400))
        elif kind == "conversation in the clear":
            _talk(port, None, framed(_GREETING) + request)
        elif kind in self._contexts:
            _talk(port, self._contexts[kind], framed(_GREETING) + request)
        else:
            _talk(port, self._own, self._malformed(kind, request))

    def run_program(self, port: int, part: str) -> None:
        """Ask for the same with a certificate of the CA."""
        _talk(port, self._own, framed(_GREETING) + program(self._folder / part), wait_s=20.0)

    def _malformed(self, kind: str, request: bytes) -> bytes:
        rng = self._rng
        if kind == "sizes":
            size = rng.choice([0, 1, 7, 1 << 20, 1 << 31, 1 << 40, 1 << 62, (1 << 64) - 1])
            greeting = rng.choice([b"", framed(_GREETING)])
            frames = struct.pack("QQ", rng.choice([1, 1 << 40, (1 << 64) - 1]), size)
            return greeting + rng.choice([struct.pack("Q", size), struct.pack("Q", 16) + frames])
        if kind == "frames":
            whole = bytearray(request)
            for _ in range(rng.randint(1, 6)):
                whole[rng.randrange(len(whole))] = rng.randrange(256)
            # A message that still names the program was not malformed enough.
            whole = bytearray(bytes(whole).replace(b"mknod", b"mk\x00od").replace(b"run", b"rum"))
            return framed(_GREETING) + bytes(whole[: rng.randint(8, len(whole))])
        if kind == "greetings":
            return framed(rng.choice(_WRONG)) + request
        if kind == "requests":
            made: dict[str, object] = {
                name: rng.choice(_WRONG) for name in rng.sample(_NAMES, rng.randint(0, 5))
            }
            if rng.random() < 0.9:
                made["op"] = rng.choice([*_OPERATIONS, *_WRONG[:6]])
            said = rng.choice([made, *_WRONG]) if rng.random() < 0.2 else made
            return framed(_GREETING) + framed(said)
        broken = packing.dumps(partial(os.getpid))[: rng.randint(0, 30)] + self._bytes(60)
        return framed(_GREETING) + framed(
            {"op": "run_function" if rng.random() < 0.5 else "run", "function": broken,
             "args": self._bytes(20), "reply": True}
        )  # fmt: skip

    def _bytes(self, most: int) -> bytes:
        return self._rng.randbytes(self._rng.randint(1, most))


_NAMES = (
    "keys", "client", "worker", "address", "who_has", "data", "workers", "function", "args",
    "versions", "graph_header", "nthreads", "name", "reply", "serializers", "close", "timeout",
)  # fmt: skip


def _context(certificates: Path | None) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    if certificates is not None:
        context.load_cert_chain(certificates / "cert.pem", certificates / "key.pem")
    return context


def _talk(
    port: int, context: ssl.SSLContext | None, said: bytes, wait_s: float = _PATIENCE_S
) -> None:
    """Connect, send, and receive for a moment; a refusal is expected."""
    with (
        contextlib.suppress(OSError),
        socket.create_connection(("127.0.0.1", port), 20.0) as plain,
        contextlib.ExitStack() as stack,
    ):
        line: socket.socket = plain
        if context is not None:
            line = stack.enter_context(context.wrap_socket(plain))
        line.sendall(said)
        line.settimeout(wait_s)
        until = time.monotonic() + wait_s
        while line.recv(65536) and time.monotonic() < until:
            pass


def attack(
    cluster: ShopCluster, attacker: Attacker, messages: int, told: Callable[[Effects], None]
) -> None:
    """Send messages, half of each kind to the scheduler and half to workers; yield each."""
    expected = list(run_tasks(_drawn, _SEEDS, str))
    workers = worker_ports(cluster)
    ports = {"scheduler": cluster.port, "worker": workers[0]}
    for at, kind in enumerate(KINDS):
        many = messages // len(KINDS) + (at < messages % len(KINDS))
        before, begun = _resident_mb(cluster), time.monotonic()
        for number in range(many):
            part = ("scheduler", "worker")[number % 2]
            attacker.send(kind, ports[part], part)
        took = time.monotonic() - begun
        found = [f"{one} ran a program" for one in attacker.markers]
        there = (cluster.scheduler, *cluster.workers)
        ended = [one for one in there if one is None or one.poll() is not None]
        found += ["a process ended"] * len(ended)
        if not ended:
            if list(run_tasks(_drawn, _SEEDS, str, site=cluster.site)) != expected:
                found.append("other digits")
            if worker_ports(cluster) != workers:
                found.append("other workers")
        told(Effects(kind, many, tuple(found), _resident_mb(cluster) - before, took))


def worker_ports(cluster: ShopCluster) -> list[int]:
    """Return the ports of the scheduler's workers."""
    with cluster.client() as client:
        known = client.scheduler_info(n_workers=-1)["workers"]
    return sorted(int(one.rpartition(":")[2]) for one in known)


def _drawn(seed: np.random.SeedSequence) -> float:
    return float(np.random.default_rng(seed).standard_normal(100).sum())


def _resident_mb(cluster: ShopCluster) -> float:
    pages = 0
    for process in (cluster.scheduler, *cluster.workers):
        with contextlib.suppress(OSError):
            if process is not None:
                text = Path("/proc", str(process.pid), "statm").read_text(encoding="ascii")
                pages += int(text.split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> int:
    """Print the table; return 1 where something had an effect."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=10_000)
    options = parser.parse_args()
    effects: list[str] = []

    def told(one: Effects) -> None:
        effects.extend(one.found)
        print(
            f"{one.kind:26s} {one.messages:6d} messages: {len(one.found)} effects, "
            f"{one.grown_mb:+7.1f} MB, {one.seconds:6.1f} s {'; '.join(one.found)}",
            flush=True,
        )

    with tempfile.TemporaryDirectory(prefix="ocmm-attack-") as name:
        place = Path(name)
        (place / "left").mkdir()
        own, others = (make_certificates(place / one) for one in ("certificates", "others"))
        cluster, attacker = ShopCluster(place, own), Attacker(place / "left", own, others)
        try:
            cluster.start_scheduler()
            cluster.start_worker()
            cluster.wait_for(1)
            attack(cluster, attacker, options.messages, told)
            attacker.run_program(cluster.port, "scheduler")
            ran = attacker.markers
        finally:
            cluster.close()
    print(f"{options.messages} messages: {len(effects)} effects (limit 0)")
    print(f"the same request by a certificate of the CA: {'ran' if ran else 'did not run'}")
    return 0 if ran and not effects else 1


if __name__ == "__main__":
    sys.exit(main())
