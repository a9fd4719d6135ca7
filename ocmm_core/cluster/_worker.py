"""What runs on a worker; both ends must be of the same version, and compute alike.

With which instructions a computer computes: what decides about the last bit besides versions.

Loops of numba are compiled for one of two kinds of processors (`ocmm_core.instructions`); numpy and
OpenBLAS choose by the processor that is there, each for itself. A sum that is taken in wider
registers is taken in another order.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from pathlib import Path
from typing import TypeVar

import ocmm_core
from ocmm_core import __version__, instructions
from ocmm_core.cluster._sentences import altered
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained

_CORES = (
    ("numpy.libs", "scipy_openblas_get_corename64_"),
    ("scipy.libs", "scipy_openblas_get_corename"),
)
"""Folder beside the package, and what its OpenBLAS is asked; of a distribution there is none."""


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """What three libraries use of a processor."""

    loops: str
    """For which kind loops are compiled, as LLVM calls it."""
    numpy: tuple[str, ...]
    """Groups of instructions beyond those that numpy always uses."""
    blas: tuple[str, ...]
    """For which processor each OpenBLAS works; as many as could be asked."""

    def __str__(self) -> str:
        """Return it in words."""
        groups = " ".join(self.numpy) or "no more than it must"
        return f"loops for {self.loops}, numpy with {groups}, OpenBLAS for {self._core}"

    @property
    def _core(self) -> str:
        return " and ".join(dict.fromkeys(self.blas)) or "an unknown processor"

    def environment_of(self, other: Arithmetic) -> Mapping[str, str] | None:
        """Return the environment in which this computer computes as another one does.

        None where it cannot: it lacks instructions that the other one uses.
        """
        has_all = set(other.numpy) <= set(self.numpy) and len(set(other.blas)) == 1
        if not has_all or (other.loops != self.loops and self.loops != instructions.AVX2):
            return None
        made = {
            "NPY_DISABLE_CPU_FEATURES": " ".join(x for x in self.numpy if x not in other.numpy),
            "OPENBLAS_CORETYPE": other.blas[0],
        } | instructions.environment(other.loops)
        same = {
            "NPY_DISABLE_CPU_FEATURES": other.numpy == self.numpy,
            "OPENBLAS_CORETYPE": other.blas == self.blas,
        } | dict.fromkeys(instructions.environment(""), other.loops == self.loops)
        return {name: value for name, value in made.items() if not same[name]}


@functools.cache
def arithmetic() -> Arithmetic:
    """Return with which instructions this process computes."""
    import numpy as np

    groups = np.show_config(mode="dicts")["SIMD Extensions"].get("found", ())
    packages = Path(np.__file__).parents[1]
    cores = [_core(packages / folder, name) for folder, name in _CORES]
    return Arithmetic(
        instructions.kind_in_use(), tuple(sorted(groups)), tuple(one for one in cores if one)
    )


def _core(folder: Path, name: str) -> str:
    """Return for which processor the OpenBLAS in a folder works; empty where nobody can say."""
    for path in sorted(folder.glob("*openblas*")):
        try:
            ask = getattr(ctypes.CDLL(str(path)), name)
        except (OSError, AttributeError):
            continue
        ask.restype = ctypes.c_char_p
        return bytes(ask() or b"").decode("ascii", "replace")
    return ""


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
