"""With which instructions a computer computes: what decides about the last bit besides versions.

Loops of numba are compiled for one of two kinds of processors (`ocmm_core.instructions`); numpy and
OpenBLAS choose by the processor that is there, each for itself. A sum that is taken in wider
registers is taken in another order.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ocmm_core import instructions

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
