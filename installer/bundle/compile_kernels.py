"""Compile all kernels for the processors that the package is for: part of installer/build.sh.

``python compile_kernels.py FOLDER`` compiles what lies in FOLDER, a copy of the sources, and leaves
in FOLDER/kernels one library and one table for each kind of processor; `installer.bundle.linked`
loads them. numba compiles as it does in a clone, up to the last step: LLVM then writes code that
may lie anywhere, which the system's linker joins. A process compiles one group for all kinds, and
all that numba counts or orders by chance is the same each time, so the results are the same, byte
for byte.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import sysconfig
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])

from installer.bundle.kinds_at_once import Another, emitted, run_nothing

_HELPERS = ("NRT_", "numba_")
"""What numba's own libraries hold and do not name to a linker."""
_PYTHON = ("Py", "_Py")


def main(folder: Path) -> int:
    """Compile everything; return the exit code."""
    sys.path.insert(0, str(folder))
    from ocmm_cli import kernel_groups
    from ocmm_core.cpu_features import KINDS, environment

    def compiled(number: int) -> bool:
        surroundings = os.environ | environment(KINDS[0])
        surroundings |= {"PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, __file__, str(folder), str(number), *KINDS]
        return subprocess.run(command, env=surroundings, check=False).returncode == 0  # noqa: S603 - this file

    for kind in KINDS:
        _objects(folder, kind).mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        if not all(list(pool.map(compiled, range(len(kernel_groups()))))):
            return 1
    (folder / "kernels").mkdir(exist_ok=True)
    for kind in KINDS:
        link(_objects(folder, kind), folder / "kernels", kind)
    return 0


def _objects(folder: Path, kind: str) -> Path:
    return folder / "objects" / kind


def compile_one(folder: Path, number: int, kinds: Sequence[str]) -> None:
    """Compile one group for all kinds, of which the environment names the first."""
    sys.path.insert(0, str(folder))
    run_nothing()
    from ocmm_cli import kernel_groups

    forget_where(folder)
    # Looking for garbage takes a seventh of the time, and the process ends soon.
    gc.disable()
    objects = _objects(folder, kinds[0])
    others = {_objects(folder, kind): Another(kind) for kind in kinds[1:]}
    rows = [
        compile_kernel(
            getattr(import_module(module), name), types, objects, f"{number}_{place}", others
        )
        for place, (module, name, types) in enumerate(kernel_groups()[number])
    ]
    for one in (objects, *others):
        (one / f"{number}.json").write_text(json.dumps(rows), encoding="utf-8")


def compile_kernel(
    kernel: Any, types: Any, objects: Path, mark: str, others: Mapping[Path, Another] | None = None
) -> list[object]:
    """Compile a function for some types, into ``MARK.o`` of each folder; return its row."""
    from numba.np.numpy_support import as_dtype

    kernel.compile(types)
    made = kernel.overloads[types]
    function = made.fndesc
    if len(types) != kernel.py_func.__code__.co_argcount:
        raise ValueError(f"{function.qualname} is listed without some of its arguments")
    libraries = {objects: made.library}
    libraries |= {one: other.library(made.library) for one, other in (others or {}).items()}
    # Each contains its callees, as optimised there by LLVM; none shares those of another.
    entry, memory = f"kernel_{mark}", f"environment_{mark}"
    for one, library in libraries.items():
        file = one / f"{mark}.o"
        file.write_bytes(emitted(library))
        _run(
            "objcopy", "--redefine-sym", f"{function.llvm_cpython_wrapper_name}={entry}",
            "--redefine-sym", f"{function.env_name}={memory}", str(file),
        )  # fmt: skip
        _run(
            "objcopy", f"--keep-global-symbol={entry}", f"--keep-global-symbol={memory}", str(file)
        )

    def word(one: Any) -> str:
        if hasattr(one, "layout"):
            return f"{as_dtype(one.dtype).str}{one.ndim}{one.layout}"
        return as_dtype(one).str

    return [
        kernel.py_func.__module__, kernel.py_func.__name__, list(map(word, types)), mark,
        [json.loads(_told(one)) for one in made.environment.consts],
    ]  # fmt: skip


def link(objects: Path, folder: Path, kind: str) -> None:
    """Link the compiled objects to ``KIND.so``, and write its contents to ``KIND.json``."""
    rows = [
        row
        for file in sorted(objects.glob("*.json"))
        for row in json.loads(file.read_text(encoding="utf-8"))
    ]
    files = [objects / f"{row[3]}.o" for row in rows]
    wanted = _run("nm", "--undefined-only", "--just-symbols", *map(str, files)).split()
    helpers = sorted({name for name in wanted if name.startswith(_HELPERS)})
    # numba's libraries hide their functions and export addresses: each gets a trampoline through a
    # table that is filled when the library is loaded.
    steps = "".join(
        f".globl {name}\n.hidden {name}\n.type {name}, @function\n"
        f"{name}: jmp *helpers+{8 * place}(%rip)\n"
        for place, name in enumerate(helpers)
    )
    source = objects / "helpers.s"
    source.write_text(
        f'.section .note.GNU-stack,"",@progbits\n.text\n{steps}.bss\n.balign 8\n'
        f".globl helpers\n.type helpers, @object\n.size helpers, {8 * len(helpers)}\n"
        f"helpers: .skip {8 * len(helpers)}\n",
        encoding="utf-8",
    )
    _run("as", "-o", str(objects / "helpers.o"), str(source))
    shown = objects / "shown"
    shown.write_text("{ global: kernel_*; environment_*; helpers; local: *; };", encoding="utf-8")
    library = folder / f"{kind}.so"
    _run(
        "ld", "-shared", "-Bsymbolic", "--build-id=none", "--hash-style=gnu", "-z", "noexecstack",
        "-z", "relro", "-z", "now", "--as-needed", "--gc-sections", f"--version-script={shown}",
        "-soname", library.name, "-o", str(library), *map(str, files), str(objects / "helpers.o"),
        *_system(),
    )  # fmt: skip
    _run("strip", "--strip-unneeded", str(library))
    missing = [
        name
        for name in _run("nm", "-D", "--undefined-only", "--just-symbols", str(library)).split()
        if "@" not in name and not name.startswith(_PYTHON)
    ]
    if missing:
        raise ValueError(f"nothing holds {', '.join(missing)}")
    table = {"helpers": helpers, "kernels": rows}
    (folder / f"{kind}.json").write_text(json.dumps(table, indent=0), encoding="utf-8")


def _system() -> list[str]:
    """Return the system's C and mathematical library, of which this process has one each."""
    import_module("math")
    mapped = {line.split()[-1] for line in Path("/proc/self/maps").read_text("utf-8").splitlines()}
    return sorted(one for one in mapped if Path(one).name.startswith(("libc.so.", "libm.so.")))


def _run(*command: str) -> str:
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)  # noqa: S603 - of binutils
    return done.stdout


def _told(value: Any) -> bytes:
    """Return in words what numba would pickle into its code; `linked` understands them."""
    from llvmlite import ir
    from numpy import dtype, ndarray

    def plain(one: Any) -> object:
        # Computed only when the error is raised.
        return {"later": True} if isinstance(one, ir.Value) else one

    if isinstance(value, dtype):
        told: dict[str, object] = {"dtype": value.str}
    elif value is ndarray:
        told = {"type": "ndarray"}
    else:
        kind, arguments, where = value
        told = {
            "error": kind.__name__,
            "arguments": None if arguments is None else list(map(plain, arguments)),
            "where": where,
        }
    return json.dumps(told).encode()


def forget_where(folder: Path) -> None:
    """Keep the folders of the build out of the results; they are others each time."""
    from numba.core import pythonapi
    from numba.core.annotations.type_annotations import TypeAnnotation
    from numba.core.caching import Cache
    from numba.core.callconv import CPUCallConv

    array_exprs = import_module("numba.np.ufunc.array_exprs")

    # No cache is written next to the sources or loaded from there.
    Cache.save_overload = lambda *_: None
    Cache.load_overload = lambda *_: None
    # Words instead of pickled objects, see `_told`.
    pythonapi.serialize = type("Words", (), {"dumps": staticmethod(_told)})

    # A text for inspecting a function.
    TypeAnnotation.__str__ = lambda _: ""

    # The place of an error: files have the names of the installed package, in the place and in the
    # words.
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

    # Whole-array code gets a name from its address in memory: here, a number.
    numbers: dict[int, tuple[int, object]] = {}
    vars(array_exprs)["hash"] = lambda told: numbers.setdefault(id(told), (len(numbers), told))[0]


if __name__ == "__main__":
    where = Path(sys.argv[1]).resolve()
    if len(sys.argv) == 2:
        sys.exit(main(where))
    compile_one(where, int(sys.argv[2]), sys.argv[3:])
