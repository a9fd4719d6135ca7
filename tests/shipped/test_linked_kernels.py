"""The package's replacement of numba computes the results of numba to the last bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from installer.bundle import linked
from installer.locks import ROOT
from ocmm_core import cpu_features
from tests.host import HANG_S, needs_tools, on_linux_only

pytestmark = on_linux_only

_KERNEL = """
import numpy as np
from numba import njit

quick = njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"})

@quick
def total(a):
    s = 0.0
    for x in a:
        s += np.sin(x) * x
    return s

@njit(cache=True, nogil=True, error_model="numpy")
def fill(a, factor, out):
    if factor < 0.0:
        raise ValueError("below")
    if len(out) != len(a):
        raise np.linalg.LinAlgError("sizes")
    row = np.empty(len(a))
    for i in range(len(a)):
        row[i] = np.dot(a[i], a[0]) * factor
    out[:] = out + row
    return total(row)
"""
_BUILD = """
import json, sys
from pathlib import Path
folder = Path(sys.argv[1])
sys.path.insert(0, str(folder))
from installer.bundle import compile_kernels, kinds_at_once
kinds_at_once.run_nothing()
compile_kernels.forget_where(folder)
import kernel, numba
line, plane = numba.float64[::1], numba.float64[:, ::1]
objects, another = folder / "objects", folder / "another"
objects.mkdir()
another.mkdir()
others = {another: kinds_at_once.Another(sys.argv[2])}
rows = [
    compile_kernels.compile_kernel(kernel.total, (line,), objects, "0_0", others),
    compile_kernels.compile_kernel(
        kernel.fill, (plane, numba.float64, plane), objects, "0_1", others
    ),
]
(folder / "kernels").mkdir()
for one, name in ((objects, "some"), (another, "another")):
    (one / "0.json").write_text(json.dumps(rows))
    compile_kernels.link(one, folder / "kernels", name)
"""
_RUN = """
import hashlib, json, sys
from pathlib import Path
folder = Path(sys.argv[1])
sys.path.insert(0, str(folder))
if sys.argv[2] == "linked":
    from installer.bundle import kernels, linked
    linked.install(folder / "kernels", "some")
import numpy as np
import kernel
assert ("llvmlite.binding" in sys.modules) == (sys.argv[2] != "linked")
told = {}
g = np.random.default_rng(7)
a = g.normal(size=(9, 9))
for name, order, factor in (("c", "C", 1.5), ("fortran", "F", 1.5), ("whole", "C", 3)):
    out = np.array(g.normal(size=a.shape), order=order)
    told[name] = kernel.fill(a, factor, out).hex(), hashlib.sha256(out.tobytes("C")).hexdigest()
both = np.asfortranarray(g.normal(size=a.shape))
said = kernel.fill(both, 1.5, both).hex()
told["in place"] = said, hashlib.sha256(both.tobytes("C")).hexdigest()
told["named"] = kernel.total(a=np.arange(33.0)).hex()
fixed = a[0].copy()
fixed.flags.writeable = False
told["read only"] = kernel.total(fixed).hex()
told["every second"] = kernel.total(np.arange(66.0)[::2]).hex()
for name, matrix, factor in (("below", a, -1.0), ("sizes", a[:4], 1.0)):
    try:
        kernel.fill(matrix, factor, a.copy())
    except Exception as error:
        told[name] = type(error).__name__, str(error)
if sys.argv[2] == "linked":
    for name, wrong in (("kind", np.arange(3)), ("axes", np.eye(2)), ("what", None)):
        try:
            kernel.total(wrong)
        except Exception as error:
            told[name] = type(error).__name__, str(error)
print(json.dumps(told))
"""


def _python(code: str, *words: str, kind: str = "generic") -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=HANG_S,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "0",
             "NUMBA_CPU_NAME": kind, "NUMBA_CPU_FEATURES": ""},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return folders with the same kernels: two for the same kind at first, and one for another."""
    needs_tools("as", "ld", "nm", "objcopy", "strip")
    folders = []
    generic, avx2 = cpu_features.GENERIC, cpu_features.AVX2
    for name, first, second in (
        ("one", generic, avx2),
        ("another/folder", generic, avx2),
        ("third", avx2, generic),
    ):
        folder = tmp_path_factory.mktemp("kernels") / name
        folder.mkdir(parents=True)
        (folder / "kernel.py").write_text(_KERNEL, encoding="utf-8")
        _python(_BUILD, str(folder), second, kind=first)
        folders.append(folder)
    return folders


def test_kernels_hold_nothing_of_the_folder_or_the_memory_they_were_compiled_in(
    built: list[Path],
) -> None:
    """An error names its file, and numba names an array expression by its address."""
    for name in ("some.so", "some.json"):
        one, another = ((folder / "kernels" / name).read_bytes() for folder in built[:2])
        assert one == another
        assert str(built[0]).encode() not in one
    library = (built[0] / "kernels" / "some.so").read_bytes()
    assert b"/opt/ocmm/_internal/kernel.py" in library
    # Nothing is unpickled: an error is described in words.
    assert b'{"error": "ValueError", "arguments": ["below"]' in library


def test_a_further_kind_gets_the_bytes_of_a_process_for_it(built: list[Path]) -> None:
    """Code written once by numba is compiled for each kind, as if requested alone."""
    one, _, third = built
    for name in ("0_0.o", "0_1.o"):
        first, second = ((one / folder / name).read_bytes() for folder in ("objects", "another"))
        assert first == (third / "another" / name).read_bytes()
        assert second == (third / "objects" / name).read_bytes()
        assert first != second


def test_linked_kernels_compute_what_numba_does(built: list[Path]) -> None:
    import numba

    folder = built[0]
    for name in linked.LIBRARIES:
        (library,) = Path(numba.__file__).parent.parent.glob(f"{name.replace('.', '/')}.*.so")
        shutil.copy(library, folder / "kernels")
    there = json.loads(_python(_RUN, str(folder), "linked"))
    refused = {name: there.pop(name) for name in ("kind", "axes", "what")}
    assert there == json.loads(_python(_RUN, str(folder), "numba"))
    assert there["below"] == ["ValueError", "below"]
    assert there["sizes"] == ["LinAlgError", "sizes"]
    # Another kind of number could come out otherwise, so nothing comes out.
    assert {kind for kind, _ in refused.values()} == {"InternalError"}
    assert "(<i81C)" in refused["kind"][1]


def test_a_kernel_goes_to_another_process_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "generic.json").write_text('{"helpers": [], "kernels": []}', encoding="utf-8")
    kernel = linked.Kernel(linked.Kernels(tmp_path, "generic"), _python)
    assert kernel.__reduce__() == "_python"
    assert kernel.__doc__ == _python.__doc__
