"""Functions for the workers of the tests; they import it by its full name."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError

UNSENDABLE = 120


def drawn(seed: np.random.SeedSequence) -> list[float]:
    """Return numbers whose last bit depends on the order of the sum."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(1000)
    return [float(values.sum()), float(np.linalg.norm(values)), float(np.sort(values) @ values)]


def some_seeds() -> list[np.random.SeedSequence]:
    return np.random.SeedSequence(22).spawn(4)


def listening(thing: int) -> list[str]:
    """Return the addresses on which the process of a worker listens."""
    found = set()
    for fd in Path("/proc/self/fd").iterdir():
        try:
            found.add(str(fd.readlink()).removeprefix("socket:[").removesuffix("]"))
        except OSError:
            continue
    lines = [
        line.split()
        for name in ("tcp", "tcp6")
        for line in Path("/proc/self/net", name).read_text(encoding="ascii").splitlines()[1:]
    ]
    return [words[1] for words in lines if words[3] == "0A" and words[9] in found]


def noted(folder: str, thing: int, content: bytes) -> tuple[int, int]:
    """Say that it is worked on, take a while, and return what came."""
    (Path(folder) / f"{thing}-{os.getpid()}").touch()
    time.sleep(0.2)
    return thing, len(content)


def some(thing: int) -> Sequence[bytes]:
    return [b"job" * (thing % 3 + 1)]


def wrong(thing: str) -> str:
    if thing == "die":
        os._exit(9)
    if thing == "bad":
        raise InputError("test.bad", "Thing bad is bad.", "Take another.")
    return thing


def unsendable(thing: int, content: bytes) -> object:
    """Return what came, and of one thing what no process can send."""
    return threading.Lock() if thing == UNSENDABLE else (thing, len(content))


def growing(thing: int) -> Sequence[bytes]:
    """Return few bytes at first and many later, of each thing its own."""
    return [thing.to_bytes(2, "big") * (5 if thing < 60 else 1500)]
