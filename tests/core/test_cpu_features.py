"""Loops are compiled for one of two kinds of processors: two computers agree to the last bit."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from installer.locks import ROOT
from ocmm_core import cpu_features
from tests.host import HANG_S

_AVX2 = {"avx", "avx2", "bmi", "bmi2", "f16c", "fma", "movbe", "popcnt", "lzcnt", "sse2"}


@pytest.mark.parametrize(
    ("features", "kind"),
    [
        (_AVX2, cpu_features.AVX2),
        (_AVX2 | {"avx512f"}, cpu_features.AVX2),
        (_AVX2 - {"fma"}, cpu_features.GENERIC),
        (set(), cpu_features.GENERIC),
    ],
)
def test_a_processor_is_of_one_of_two_kinds(features: set[str], kind: str) -> None:
    assert cpu_features.kind_of(features) == kind


@pytest.mark.parametrize("before", ["", "import numba\n"])
@pytest.mark.parametrize("asked", ["", cpu_features.GENERIC])
def test_the_loops_are_compiled_for_a_kind_not_for_this_very_processor(
    asked: str, before: str
) -> None:
    """Told by what numba keeps them under, with all that is imported of numba before."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    if asked:
        plain |= cpu_features.environment(asked)
    code = before + (
        "from ocmm_core.tracking.kernels import cholesky\n"
        "import ocmm_cli._kernels\n"
        "print(cholesky.targetctx.codegen().magic_tuple())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=HANG_S, check=True,
        env=plain,
    )  # fmt: skip
    _, name, features = ast.literal_eval(done.stdout)
    assert features == ""
    assert name in ({asked} if asked else set(cpu_features.KINDS))


def test_nobody_takes_the_decorator_of_numba_itself() -> None:
    imported = re.compile(
        r"from numba import .*\b(njit|jit|vectorize)\b|numba\.(njit|jit|vectorize)\("
    )
    users = {
        path.relative_to(ROOT).as_posix()
        for path in ROOT.glob("ocmm_*/**/*.py")
        if imported.search(path.read_text(encoding="utf-8"))
    }
    assert users == {"ocmm_core/cpu_features.py"}


def test_code_that_another_process_kept_for_other_types_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two compile at once: both write the file that was free, each with the code for its types."""
    source = tmp_path / "halves.py"
    source.write_text(
        "from ocmm_core.cpu_features import njit\n"
        "@njit(cache=True)\n"
        "def half(number):\n"
        "    return number // 2\n"
    )
    kept = tmp_path / "__pycache__"

    def process() -> ModuleType:
        return _module_of(source, monkeypatch)

    assert process().half(7) == 3
    (index,) = kept.glob("*.nbi")
    for_integers = index.read_bytes()
    index.unlink()
    assert process().half(7.0) == 3.0
    # The index that one wrote, and the code that the other one wrote after it.
    index.write_bytes(for_integers)
    third = process()
    found = third.half(7)
    assert (found, type(found)) == (3, int)
    assert sum(third.half.stats.cache_misses.values()) == 1
    # Compiled again it is stored, and found unchanged.
    fourth = process()
    assert fourth.half(7) == 3
    assert sum(fourth.half.stats.cache_hits.values()) == 1


def test_code_kept_for_a_class_that_was_renamed_is_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "pairs.py"
    for name in ("Pair", "Couple"):
        source.write_text(
            "from typing import NamedTuple\n"
            "from ocmm_core.cpu_features import njit\n"
            f"class {name}(NamedTuple):\n"
            "    one: int\n"
            "    other: int\n"
            "@njit(cache=True)\n"
            "def total(pair):\n"
            "    return pair.one + pair.other\n"
            "@njit(cache=True)\n"
            "def of_two(one, other):\n"
            f"    return total({name}(one, other))\n"
        )
        assert _module_of(source, monkeypatch).of_two(3, 4) == 7


def _module_of(source: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location(source.stem, source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # The place in which numba searches for the owner of the code.
    monkeypatch.setitem(sys.modules, source.stem, module)
    spec.loader.exec_module(module)
    return module
