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
from pathlib import Path
from typing import TypeVar

import ocmm_core
from ocmm_core import __version__
from ocmm_core.cluster._arithmetic import Arithmetic, arithmetic
from ocmm_core.cluster._sentences import altered
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Computer:
    """Program and processor of a computer: together they decide its digits."""

    versions: str
    """Of OCMM, Python and the packages that compute, with the hash of the program files."""
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
def build() -> str:
    """Return the SHA-256 of all program files of the core: a changed line changes it.

    The files are the same in a checkout and in a wheel. A version number is not enough: digits
    follow from the code.
    """
    root = Path(ocmm_core.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py"), key=lambda one: one.relative_to(root).as_posix()):
        # A line that Windows ends otherwise is the same program.
        content = path.read_bytes().replace(b"\r\n", b"\n")
        name = path.relative_to(root).as_posix()
        digest.update(f"{name} {hashlib.sha256(content).hexdigest()}\n".encode())
    return digest.hexdigest()


@functools.cache
def versions() -> str:
    """Return the build of OCMM, and the versions of Python and of the packages that compute."""
    names = ["numpy", "scipy", "numba"]
    found = [f"OCMM {__version__} (build {build()[:12]})", f"Python {platform.python_version()}"]
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
