"""Code on a worker, and checks that both ends have the same version and arithmetic.

In addition to versions, instruction sets decide the last bit: loops of numba are compiled for one
of two kinds of processors (`ocmm_core.cpu_features`); numpy and OpenBLAS each choose by the actual
processor, and wider registers change the order of sums.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import platform
import shlex
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from pathlib import Path
from typing import TypeVar

import ocmm_core
from ocmm_core import __version__, cpu_features
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.failure import contained

_PACKAGES = ("ocmm_bench", "ocmm_cad", "ocmm_cli", "ocmm_core", "ocmm_shop", "ocmm_sim")
"""All that compute; the window does not."""
_CORES = (
    ("numpy.libs", "scipy_openblas_get_corename64_"),
    ("scipy.libs", "scipy_openblas_get_corename"),
)
"""Folder next to the package, and query function of its OpenBLAS; distributions have none."""


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """Processor features used by three libraries."""

    loops: str
    """Target of compiled loops, as named by LLVM."""
    numpy: tuple[str, ...]
    """Instruction groups beyond numpy's baseline."""
    blas: tuple[str, ...]
    """Target of each OpenBLAS that could be queried."""

    def __str__(self) -> str:
        groups = " ".join(self.numpy) or "no more than it must"
        return f"loops for {self.loops}, numpy with {groups}, OpenBLAS for {self._core}"

    @property
    def _core(self) -> str:
        return " and ".join(dict.fromkeys(self.blas)) or "an unknown processor"

    def environment_of(self, other: Arithmetic) -> Mapping[str, str] | None:
        """Return the environment to compute as another computer; None if instructions lack."""
        has_all = set(other.numpy) <= set(self.numpy) and len(set(other.blas)) == 1
        if not has_all or (other.loops != self.loops and self.loops != cpu_features.AVX2):
            return None
        made = {
            "NPY_DISABLE_CPU_FEATURES": " ".join(x for x in self.numpy if x not in other.numpy),
            "OPENBLAS_CORETYPE": other.blas[0],
        } | cpu_features.environment(other.loops)
        same = {
            "NPY_DISABLE_CPU_FEATURES": other.numpy == self.numpy,
            "OPENBLAS_CORETYPE": other.blas == self.blas,
        } | dict.fromkeys(cpu_features.environment(""), other.loops == self.loops)
        return {name: value for name, value in made.items() if not same[name]}


@functools.cache
def arithmetic() -> Arithmetic:
    import numpy as np

    groups = np.show_config(mode="dicts")["SIMD Extensions"].get("found", ())
    packages = Path(np.__file__).parents[1]
    cores = [_core(packages / folder, name) for folder, name in _CORES]
    return Arithmetic(
        cpu_features.kind_in_use(), tuple(sorted(groups)), tuple(one for one in cores if one)
    )


def _core(folder: Path, name: str) -> str:
    """Return the target of the OpenBLAS in a folder; empty if unknown."""
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
class WorkerPlatform:
    """Program and processor of a computer, which determine its digits."""

    versions: str
    """Of OCMM, Python and the packages that compute, with the hash of the program files."""
    arithmetic: Arithmetic


@dataclass(frozen=True, slots=True)
class Refused:
    """A worker that refused to start, with its properties."""

    computer: WorkerPlatform


@dataclass(frozen=True, slots=True)
class TaskRequest:
    """A thing, the name of its work, and the SHA-256 of each of its contents."""

    thing: object
    name: str
    hashes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Done:
    """The answers for some things, in order, and their total time."""

    answers: tuple[object, ...]
    seconds: float


@functools.cache
def build() -> str:
    """Return the SHA-256 of all program files, in checkout and wheel: digits follow from code."""
    root = Path(ocmm_core.__file__).parents[1]
    digest = hashlib.sha256()
    # Work may be of any package; one that a computer lacks is another build.
    paths = [path for name in _PACKAGES for path in (root / name).rglob("*.py")]
    for path in sorted(paths, key=lambda one: one.relative_to(root).as_posix()):
        # Line endings of Windows are equivalent.
        content = path.read_bytes().replace(b"\r\n", b"\n")
        name = path.relative_to(root).as_posix()
        digest.update(f"{name} {hashlib.sha256(content).hexdigest()}\n".encode())
    return digest.hexdigest()


@functools.cache
def versions() -> str:
    """Return the build of OCMM, and the versions of Python and of the packages that compute."""
    found = [f"OCMM {__version__} (build {build()[:12]})", f"Python {platform.python_version()}"]
    for name in ("numpy", "scipy", "numba"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"no {name}")
    return ", ".join(found)


def this_computer() -> WorkerPlatform:
    return WorkerPlatform(versions(), arithmetic())


def refusal(who: str, theirs: object, ours: WorkerPlatform) -> InputError:
    """Return why a worker unlike this computer could give other digits."""
    if not isinstance(theirs, WorkerPlatform):
        # A worker without that class has another version.
        return other_version(who, named(theirs), ours.versions)
    if theirs.versions != ours.versions:
        return other_version(who, theirs.versions, ours.versions)
    there = theirs.arithmetic.environment_of(ours.arithmetic)
    here = ours.arithmetic.environment_of(theirs.arithmetic)
    return other_processor(who, str(theirs.arithmetic), str(ours.arithmetic), there, here)


def named(found: object) -> str:
    return found if isinstance(found, str) else f"another version ({type(found).__name__})"


def other_version(who: str, theirs: str, ours: str) -> InputError:
    return InputError(
        "cluster.version",
        f"{who} has {theirs}; this computer has {ours}. Their digits could differ.",
        "Install the same program there and start it again, or stop it, then run this again.",
    )


def other_processor(
    who: str, theirs: str, ours: str, there: Mapping[str, str] | None,
    here: Mapping[str, str] | None,
) -> InputError:  # fmt: skip
    """Return the error of another processor; `there`, `here`: possible environments, or None."""
    if there:
        remedy = f"Start that worker with {_assigned(there)}"
    elif here:
        remedy = f"Run this again with {_assigned(here)}"
    else:
        remedy = "Stop that worker"
    return InputError(
        "cluster.processor",
        f"{who} computes otherwise ({theirs}) than this computer ({ours}). Last digits could "
        "differ.",
        f"{remedy}, or leave out --scheduler to compute here (docs/integrator/cluster.md).",
    )


def _assigned(environment: Mapping[str, str]) -> str:
    return " ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items())


def held(content: bytes) -> bytes:
    """Return its argument: a task keeps bytes, recomputed by Dask if its worker is lost."""
    return content


def do(
    ours: WorkerPlatform, work: Callable[..., R], asked: Sequence[TaskRequest], *contents: bytes
) -> Done | Refused:
    """Compute some things; errors are answers; `contents`: in turn, as many as each has hashes."""
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
    """Return the result of one thing, after verifying its contents."""
    try:
        for sha256, content in zip(hashes, contents, strict=True):
            if hashlib.sha256(content).hexdigest() != sha256:
                raise StorageError(
                    "cluster.content",
                    f"Content {sha256[:12]} arrived altered at a worker.",
                    "Run this again; if it happens again, check that nobody else uses this "
                    "scheduler.",
                )
        return work(thing, *contents)
    except Exception as error:
        return contained(error, name)
