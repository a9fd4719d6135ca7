"""What runs on a worker; both ends must be of the same version."""

from __future__ import annotations

import functools
import hashlib
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TypeVar

from ocmm_core import __version__
from ocmm_core.cluster._sentences import altered
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Refused:
    """A worker that did not begin: what it has."""

    versions: str


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


def held(content: bytes) -> bytes:
    """Return what it is given: a task that keeps bytes on a worker.

    Dask makes a lost result again from its task, so these bytes survive any worker.
    """
    return content


def do(
    ours: str,
    work: Callable[..., R],
    thing: object,
    name: str,
    hashes: Sequence[str],
    *contents: bytes,
) -> R | OcmmError | Refused:
    """Do the work on one thing; errors are answers, as in `processes.side_by_side`.

    Parameters
    ----------
    ours
        `versions` of the computer that asks.
    name
        Of the work, as the beginning of a sentence.
    hashes
        SHA-256 of each of ``contents``.
    """
    if versions() != ours:
        return Refused(versions())
    return answer(work, thing, name, hashes, contents)


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
