"""Compile all kernels for the processors that the package is for: part of installer/build.sh.

``python -I compile_kernels.py FOLDER`` compiles what lies in FOLDER (``_internal`` of the bundle)
and keeps the results there. A process compiles one group for one kind of processor, and all that
numba counts or orders by chance is the same each time, so the results are the same, byte for byte.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def main(folder: Path) -> int:
    """Compile everything; return the exit code."""
    # numba makes no folder here: the one of the package is not to be written to.
    for file in sorted(folder.glob("ocmm_core/**/*.py")):
        (file.parent / "__pycache__").mkdir(exist_ok=True)
    sys.path.insert(0, str(folder))
    from installer.bundle.kernels import KINDS, environment
    from ocmm_core.composition import kernel_groups

    # One kind after the other: two processes that compile the same function would each forget what
    # the other one wrote into its list of results.
    for kind in KINDS:
        surroundings = os.environ | environment(kind)
        surroundings |= {"PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}

        def compiled(number: int, surroundings: dict[str, str] = surroundings) -> int:
            command = [sys.executable, __file__, str(folder), str(number)]
            done = subprocess.run(command, env=surroundings, check=False)  # noqa: S603 - this file
            return done.returncode

        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            if any(pool.map(compiled, range(len(kernel_groups())))):
                return 1
    functions = sum(map(len, kernel_groups()))
    results = sum(1 for _ in folder.glob("ocmm_core/**/*.nbc"))
    # A folder that cannot be written to is no error for numba as the package uses it.
    if results < len(KINDS) * functions:
        sys.stderr.write(f"Only {results} results of {functions} functions were kept.\n")
        return 1
    return 0


def compile_one(folder: Path, number: int) -> None:
    """Compile one group for the processor that the environment names."""
    sys.path.insert(0, str(folder))
    from numba.core.annotations.type_annotations import TypeAnnotation

    from ocmm_core.composition import compile_group

    # A text for whoever looks into a function; it names the folder of the build.
    TypeAnnotation.__str__ = lambda _: ""
    compile_group(number)


if __name__ == "__main__":
    where = Path(sys.argv[1]).resolve()
    if len(sys.argv) == 2:
        sys.exit(main(where))
    compile_one(where, int(sys.argv[2]))
