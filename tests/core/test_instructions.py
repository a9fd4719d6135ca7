"""Loops are compiled for one of two kinds of processors: two computers agree to the last bit."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys

import pytest

from installer.locks import ROOT
from ocmm_core import instructions
from tests.host import HANG_S

_AVX2 = {"avx", "avx2", "bmi", "bmi2", "f16c", "fma", "movbe", "popcnt", "lzcnt", "sse2"}


@pytest.mark.parametrize(
    ("features", "kind"),
    [
        (_AVX2, instructions.AVX2),
        (_AVX2 | {"avx512f"}, instructions.AVX2),
        (_AVX2 - {"fma"}, instructions.GENERIC),
        (set(), instructions.GENERIC),
    ],
)
def test_a_processor_is_of_one_of_two_kinds(features: set[str], kind: str) -> None:
    assert instructions.kind_of(features) == kind


@pytest.mark.parametrize("asked", ["", instructions.GENERIC])
def test_the_loops_are_compiled_for_a_kind_not_for_this_very_processor(asked: str) -> None:
    """Told by what numba keeps them under, with all that ours imports of numba before."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    if asked:
        plain |= instructions.environment(asked)
    code = (
        "from ocmm_core.tracking.kernels import cholesky\n"
        "import ocmm_core.composition._kernels\n"
        "print(cholesky.targetctx.codegen().magic_tuple())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=HANG_S, check=True,
        env=plain,
    )  # fmt: skip
    _, name, features = ast.literal_eval(done.stdout)
    assert features == ""
    assert name in ({asked} if asked else set(instructions.KINDS))


def test_nobody_takes_the_decorator_of_numba_itself() -> None:
    imported = re.compile(
        r"from numba import .*\b(njit|jit|vectorize)\b|numba\.(njit|jit|vectorize)\("
    )
    users = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "ocmm_core").rglob("*.py")
        if imported.search(path.read_text(encoding="utf-8"))
    }
    assert users == {"ocmm_core/instructions.py"}
