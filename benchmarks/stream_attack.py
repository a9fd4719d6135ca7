"""What a good client of the live stream notices of an attack.

A station on the virtual rig measures and streams; one client has the token and notes when poses
come. First nobody else is there; then other processes, without the token, hold silent connections,
send floods and garbage, half a handshake, and read nothing. Printed are the gaps between poses with
and without them, what the attackers did, and the memory before and after.
Run: ``python -m benchmarks.stream_attack [--clients N] [--messages N] [--seconds S]``.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import random
import resource as limits
import socket
import sys
import tempfile
import threading
import time
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

import numpy as np

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.station.stream import StreamOptions, StreamServer

CLIENTS, MESSAGES, SECONDS = 1000, 100_000, 20.0
GAP_LIMIT_S = 0.1
TOKEN = "0123456789abcdef-token"  # noqa: S105 - of a benchmark
_ATTACKERS = 2


class Listener:
    """The good client: it has the token, and notes when each pose came."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._socket = socket.create_connection(address, timeout=30.0)
        self._socket.sendall(json.dumps({"token": TOKEN}).encode() + b"\n")
        self.came: list[float] = []
        self.ended = ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="listener")
        self._thread.start()

    def _read(self) -> None:
        try:
            with self._socket.makefile("rb") as lines:
                for line in lines:
                    if self._stop.is_set():
                        return
                    if line.startswith(b'{"v":1,"type":"pose"'):
                        self.came.append(time.monotonic())
                    elif b'"type":"bye"' in line:
                        self.ended = line.decode()
        except OSError as error:
            self.ended = str(error)

    def close(self) -> None:
        """End; the thread is gone afterwards."""
        self._stop.set()
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._socket.close()


def attack(
    address: tuple[str, int], seed: int, clients: int, messages: int, sent: Synchronized[int],
    connected: Synchronized[int], until: float,
) -> None:  # fmt: skip
    """Hold silent connections, and send garbage on others, until the time is over."""
    soft, hard = limits.getrlimit(limits.RLIMIT_NOFILE)
    limits.setrlimit(limits.RLIMIT_NOFILE, (min(hard, max(soft, 4 * clients)), hard))
    rng = random.Random(seed)  # noqa: S311 - a benchmark
    held: list[socket.socket] = []
    said = 0
    while time.monotonic() < until:
        if len(held) < clients:
            with contextlib.suppress(OSError):
                held.append(socket.create_connection(address, timeout=1.0))
                connected.value += 1
        else:
            held.pop(rng.randrange(len(held))).close()
        if said < messages:
            said += _talk(address, rng, min(200, messages - said))
            sent.value = said


def _talk(address: tuple[str, int], rng: random.Random, messages: int) -> int:
    kind = rng.randrange(4)
    done = 0
    with contextlib.suppress(OSError), socket.create_connection(address, timeout=1.0) as one:
        for _ in range(messages):
            # Counted as sent, even without a receiver.
            done += 1
            if kind == 0:
                one.sendall(rng.randbytes(rng.randint(1, 400)) + b"\n")
            elif kind == 1:
                one.sendall(b"x" * 4096)
            elif kind == 2:
                one.sendall(b"\x16\x03\x01\x02\x00" + rng.randbytes(20))
            else:
                one.sendall(b'{"token": "%d"}\n' % rng.randrange(10**9))
    return max(done, 1)


def gaps(came: list[float], since: float) -> np.ndarray:
    """Return the seconds between poses that came after a moment."""
    times = np.array([one for one in came if one >= since])
    return np.diff(times) if len(times) > 1 else np.array([np.inf])


def resident_mib() -> float:
    """Return the memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=CLIENTS)
    parser.add_argument("--messages", type=int, default=MESSAGES)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parsed = parser.parse_args(arguments)
    failures: list[Exception] = []
    context = multiprocessing.get_context("spawn")
    sent = [context.Value("i", 0) for _ in range(_ATTACKERS)]
    connected = [context.Value("i", 0) for _ in range(_ATTACKERS)]
    with tempfile.TemporaryDirectory() as folder:
        station = build_station(
            StationRequest(
                plan=resource("plans", "quick.toml"), out=Path(folder), frame_rate_hz=500,
                speed=0.1, stay=True,
            )
        ).station  # fmt: skip
        try:
            server = StreamServer(station, StreamOptions(token=TOKEN), failures.append)
            with server:
                station.start()
                listener = Listener(server.address)
                time.sleep(2.0)
                begun, before = time.monotonic(), resident_mib()
                time.sleep(parsed.seconds)
                quiet = gaps(listener.came, begun)
                attackers = [
                    context.Process(
                        target=attack,
                        args=(
                            server.address, seed, parsed.clients // _ATTACKERS,
                            parsed.messages // _ATTACKERS, sent[seed], connected[seed],
                            time.monotonic() + parsed.seconds + 3.0,
                        ),
                    )
                    for seed in range(_ATTACKERS)
                ]  # fmt: skip
                for one in attackers:
                    one.start()
                time.sleep(3.0)
                since = time.monotonic()
                time.sleep(parsed.seconds)
                attacked, after = gaps(listener.came, since), resident_mib()
                for one in attackers:
                    one.join()
                listener.close()
                alive = Listener(server.address)
                time.sleep(1.0)
                alive.close()
        finally:
            station.close()
    total, held = sum(one.value for one in sent), sum(one.value for one in connected)
    print(f"attackers: {held} silent connections made, {total} messages, {_ATTACKERS} processes")
    print(f"{'poses':12}{'N':>8}{'median ms':>12}{'p99 ms':>10}{'largest ms':>12}{'> 100 ms':>10}")
    for name, found in (("alone", quiet), ("attacked", attacked)):
        print(
            f"{name:12}{len(found):8}{1e3 * np.median(found):12.1f}"
            f"{1e3 * np.percentile(found, 99):10.1f}{1e3 * found.max():12.1f}"
            f"{int((found > GAP_LIMIT_S).sum()):10}"
        )
    print(f"memory {before:.0f} MiB before, {after:.0f} MiB under attack")
    print(f"good client ended: {listener.ended or 'no'}; after it {len(alive.came)} poses in 1 s")
    for error in failures:
        print(f"failed: {error!r}")
    late = int((attacked > GAP_LIMIT_S).sum())
    return 1 if failures or listener.ended or not alive.came or late else 0


if __name__ == "__main__":
    sys.exit(main())
