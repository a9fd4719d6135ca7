"""What runs on a worker; both ends must be of the same version, and compute alike."""

from __future__ import annotations

import functools
import hashlib
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from typing import TypeVar

from ocmm_core import __version__
from ocmm_core.cluster._arithmetic import Arithmetic, arithmetic
from ocmm_core.cluster._sentences import altered
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Computer:
    """What decides about the digits that a computer finds: packages, and how it computes."""

    versions: str
    arithmetic: Arithmetic


@dataclass(frozen=True, slots=True)
class Refused:
    """A worker that did not begin: what it has."""

    computer: Computer


@dataclass(frozen=True, slots=True)
class Asked:
    """A thing, what the work on it is called, and the SHA-256 of each content that it needs."""

    thing: object
    name: str
    hashes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Done:
    """The answers for some things, in their order, and how long they took together."""

    answers: tuple[object, ...]
    seconds: float


@functools.cache
def versions() -> str:
    """Return what decides about digits: of OCMM, Python and the packages that compute."""
    names = ["numpy", "scipy", "numba"]
    found = [f"OCMM {__version__}", f"Python {platform.python_version()}"]
    for name in names:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"no {name}")
    return ", ".join(found)


def this_computer() -> Computer:
    """Return what decides about digits here."""
    return Computer(versions(), arithmetic())


def held(content: bytes) -> bytes:
    """Return what it is given: a task that keeps bytes on a worker.

    Dask makes a lost result again from its task, so these bytes survive any worker.
    """
    return content


def do(
    ours: Computer, work: Callable[..., R], asked: Sequence[Asked], *contents: bytes
) -> Done | Refused:
    """Do the work on some things; errors are answers, as in `processes.side_by_side`.

    Parameters
    ----------
    ours
        The computer that asks.
    contents
        Of one thing after the other, as many as each has hashes.
    """
    if this_computer() != ours:
        return Refused(this_computer())
    begun, rest = time.monotonic(), iter(contents)
    answers = tuple(
        answer(work, one.thing, one.name, one.hashes, list(islice(rest, len(one.hashes))))
        for one in asked
    )
    return Done(answers, time.monotonic() - begun)


def answer(
    work: Callable[..., R],
    thing: object,
    name: str,
    hashes: Sequence[str],
    contents: Sequence[bytes],
) -> R | OcmmError:
    """Return what came of one thing, after a look at the bytes that it rests on."""
    try:
        for sha256, content in zip(hashes, contents, strict=True):
            if hashlib.sha256(content).hexdigest() != sha256:
                raise altered(sha256)
        return work(thing, *contents)
    except Exception as error:
        return contained(error, name)
