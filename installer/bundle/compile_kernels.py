"""Compile all kernels for the processors that the package is for: part of installer/build.sh.

``python compile_kernels.py FOLDER`` compiles what lies in FOLDER, a copy of the sources, and keeps
the results there. A process compiles one group for one kind of processor, and all that numba counts
or orders by chance is the same each time, so the results are the same, byte for byte. No two
processes share a list of results: each kind has its folders, and each group its functions.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import sysconfig
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path


def main(folder: Path) -> int:
    """Compile everything; return the exit code."""
    sys.path.insert(0, str(folder))
    from installer.bundle.kernels import KINDS, environment, kernels_beside
    from ocmm_core.composition import kernel_groups

    # numba makes no folder here: the one of the package is not to be written to.
    for kind in KINDS:
        for file in folder.glob("ocmm_core/**/*.py"):
            kernels_beside(file, kind).mkdir(parents=True, exist_ok=True)

    def compiled(task: tuple[int, str]) -> tuple[str, list[str]]:
        number, kind = task
        surroundings = os.environ | environment(kind)
        surroundings |= {"PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, __file__, str(folder), str(number)]
        done = subprocess.run(  # noqa: S603 - this file
            command, env=surroundings, check=False, stdout=subprocess.PIPE, text=True
        )
        return kind, done.stdout.split() if done.returncode == 0 else []

    # The longest come first, for all kinds.
    tasks = list(product(range(len(kernel_groups())), KINDS))
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        written = list(pool.map(compiled, tasks))
    if not all(names for _, names in written):
        return 1
    times = Counter((kind, name) for kind, names in written for name in names)
    if twice := sorted({name for (_, name), count in times.items() if count > 1}):
        sys.stderr.write(
            f"Two groups compile {', '.join(twice)}: put what shares them into one group of "
            "ocmm_core/composition/_kernels.py.\n"
        )
        return 1
    functions = sum(map(len, kernel_groups()))
    for kind in KINDS:
        results = sum(1 for _ in folder.glob(f"ocmm_core/**/{kind}/*.nbc"))
        # A folder that cannot be written to is no error for numba as the package uses it.
        if results < functions:
            sys.stderr.write(f"Only {results} results of {functions} functions were kept.\n")
            return 1
    return 0


def compile_one(folder: Path, number: int) -> None:
    """Compile one group for the processor that the environment names; print what was compiled."""
    sys.path.insert(0, str(folder))
    from numba.core import event

    from ocmm_core.composition import compile_group

    class Names(event.Listener):  # type: ignore[misc] # numba ships no annotations
        def __init__(self) -> None:
            self.found: set[str] = set()

        def on_start(self, event: object) -> None:
            function = event.data["dispatcher"].py_func  # type: ignore[attr-defined] # as above
            if function.__module__.startswith("ocmm_core."):
                self.found.add(f"{function.__module__}.{function.__qualname__}")

        def on_end(self, event: object) -> None:
            pass

    _forget_where(folder)
    # Looking for garbage takes a seventh of the time, and the process ends soon.
    gc.disable()
    names = Names()
    with event.install_listener("numba:compile", names):
        compile_group(number)
    sys.stdout.write("\n".join(sorted(names.found)))


def _forget_where(folder: Path) -> None:
    """Keep the folders of the build out of the results; they are others each time."""
    from numba.core.annotations.type_annotations import TypeAnnotation
    from numba.core.callconv import CPUCallConv
    from numba.np.ufunc import array_exprs

    # A text for whoever looks into a function.
    TypeAnnotation.__str__ = lambda _: ""

    # Where an error is raised: files are named as they are called where the package is installed,
    # in the place and in the words.
    built = CPUCallConv.build_excinfo_struct
    folders = sorted({str(folder), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")})

    def installed(told: object) -> object:
        if isinstance(told, tuple):
            return tuple(map(installed, told))
        if isinstance(told, str):
            for one in folders:
                told = told.replace(f"{one}/", "/opt/ocmm/_internal/")
        return told

    CPUCallConv.build_excinfo_struct = lambda self, *told: installed(built(self, *told))

    # What is computed with whole arrays gets a name from its address in memory: here, a number.
    numbers: dict[int, tuple[int, object]] = {}
    array_exprs.hash = lambda told: numbers.setdefault(id(told), (len(numbers), told))[0]


if __name__ == "__main__":
    where = Path(sys.argv[1]).resolve()
    if len(sys.argv) == 2:
        sys.exit(main(where))
    compile_one(where, int(sys.argv[2]))
