"""What the workers of the tests do; they import it by its full name."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError


def drawn(seed: np.random.SeedSequence) -> list[float]:
    """Return numbers whose last bit depends on the order of the sum."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(1000)
    return [float(values.sum()), float(np.linalg.norm(values)), float(np.sort(values) @ values)]


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
