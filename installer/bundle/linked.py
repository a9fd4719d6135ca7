"""The kernels of the package: compiled when it was built, loaded without numba and LLVM.

`install` puts modules in the place of numba before OCMM is imported, so OCMM's sources are the same
in a clone and in the package. What a decorator returns then is a `Kernel`. Its functions are what
numba itself would call: they come from the library that `compile_kernels` made, and three small
libraries of numba serve them, for errors, memory and arrays.

numba chooses among what it compiled by the types of the arguments, and so does a `Kernel`. What it
does not have it does not compile: arrays in another order, or that may not be written to, are
copied, and a whole number is taken for a float. All else is refused.
"""

from __future__ import annotations

import builtins
import ctypes
import inspect
import json
import os
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import update_wrapper
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from ocmm_core import cpu_features

LIBRARIES = ("numba._dynfunc", "numba._helperlib", "numba.core.runtime._nrt_python")
"""Of numba, without its packages."""
_SCALARS = {float: "<f8", int: "<i8", bool: "|b1", complex: "<c16"}
_NUMBERS: dict[str, type] = {"<f8": float, "<i8": int}
"""What whole numbers may be given as."""
# Of numpy's flags: in C order, in Fortran's, aligned, may be written to.
_C, _F, _USABLE = 0x1, 0x2, 0x500
_ARRAYS: dict[tuple[Any, int, int], str] = {}
"""Earlier results; there are few."""


class Kernels:
    """The library of one kind, and its table.

    Parameters
    ----------
    folder
        Where ``KIND.so``, ``KIND.json`` and numba's libraries are.
    kind
        Of processor, see `cpu_features.KINDS`.
    """

    def __init__(self, folder: Path, kind: str) -> None:
        self._folder, self._kind = folder, kind
        table = json.loads((folder / f"{kind}.json").read_text(encoding="utf-8"))
        self._helpers: list[str] = table["helpers"]
        self._rows: dict[tuple[str, str], list[tuple[tuple[str, ...], str, list[Any]]]] = {}
        for module, name, words, mark, consts in table["kernels"]:
            self._rows.setdefault((module, name), []).append((tuple(words), mark, consts))
        self._lock = threading.Lock()
        self._loaded: tuple[ctypes.CDLL, Any] | None = None
        # The library points at these.
        self._kept: list[Any] = []

    def types_of(self, function: Callable[..., Any]) -> list[tuple[str, ...]]:
        """Return for which types of its arguments a function was compiled."""
        rows = self._rows.get((function.__module__, function.__name__), [])
        return [words for words, _, _ in rows]

    def load(self, function: Callable[..., Any], words: tuple[str, ...]) -> Callable[..., Any]:
        """Return a function as it was compiled for these types."""
        with self._lock:
            library, dynfunc = self._loaded or self._load()
            rows = self._rows[function.__module__, function.__name__]
            mark, consts = next((mark, consts) for one, mark, consts in rows if one == words)
            environment = dynfunc.Environment({})
            environment.consts.extend(map(_value, consts))
            ctypes.c_void_p.in_dll(library, f"environment_{mark}").value = id(environment)
            self._kept.append(environment)
            address = ctypes.addressof(ctypes.c_char.in_dll(library, f"kernel_{mark}"))
            made: Callable[..., Any] = dynfunc.make_function(
                sys.modules[function.__module__], function.__name__, function.__doc__ or "",
                address, environment, (library,),
            )  # fmt: skip
            return made

    def _load(self) -> tuple[ctypes.CDLL, Any]:
        dynfunc, helperlib, memory = (_extension(self._folder, name) for name in LIBRARIES)
        library = ctypes.CDLL(str(self._folder / f"{self._kind}.so"))
        numbers = helperlib.c_helpers | dynfunc.c_helpers
        places = (ctypes.c_void_p * len(self._helpers)).in_dll(library, "helpers")
        for number, name in enumerate(self._helpers):
            start, _, short = name.partition("_")
            places[number] = (memory.c_helpers if start == "NRT" else numbers)[short]
        self._loaded = library, dynfunc
        return self._loaded


class Kernel:
    """A function of OCMM that was compiled, for each combination of types that Python calls."""

    _cache = SimpleNamespace(_cache_file=SimpleNamespace(_source_stamp=None))
    """`ocmm_core.cpu_features.njit` lists the dependencies of a result in a clone."""

    def __init__(self, kernels: Kernels, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._kernels = kernels
        self._made: dict[tuple[str, ...], Callable[..., Any]] = {}
        self._listed = kernels.types_of(function)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__

    def compile(self, types: object) -> None:
        """Do nothing: it is compiled."""

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call it as it was compiled for these arguments."""
        if named:
            args = inspect.signature(self.py_func).bind(*args, **named).args
        words = tuple([_word(one) for one in args])
        made = self._made.get(words) or self._compiled(words)
        return self._adapted(args, words) if made is None else made(*args)

    def _compiled(self, words: tuple[str, ...]) -> Callable[..., Any] | None:
        if words in self._listed and words not in self._made:
            self._made[words] = self._kernels.load(self.py_func, words)
        return self._made.get(words)

    def _adapted(self, args: Sequence[Any], words: tuple[str, ...]) -> Any:
        """Call it with copies of compiled types; written data are copied back."""
        for listed in self._listed:
            fit = [*map(_fitted, args, words, listed)] if len(listed) == len(args) else [None]
            made = self._compiled(listed)
            if made is not None and all(one is not None for one in fit):
                copies = [
                    (one, copy, copy.tobytes())
                    for one, copy in zip(args, fit, strict=True)
                    if copy is not None and copy is not one and hasattr(copy, "tobytes")
                ]
                answer = made(*fit)
                for one, copy, before in copies:
                    # An argument only read may overlap a written one, and keeps the latter's
                    # content.
                    if one.flags.writeable and copy.tobytes() != before:
                        one[...] = copy
                return answer
        from ocmm_core.errors import InternalError

        name = f"{self.py_func.__module__}.{self.py_func.__name__}"
        raise InternalError(
            "package.kernel",
            f"The package holds no kernel {name} for ({', '.join(words)}).",
            "Send the log to whoever looks after OCMM; a clone compiles what is missing.",
        )


def _word(value: Any) -> str:
    """Return the type of an argument as the table writes it; an odd one is in no table."""
    word = _SCALARS.get(type(value))
    if word is not None:
        return word
    if isinstance(value, sys.modules["numpy"].ndarray):
        asked = value.dtype, value.ndim, value.flags.num & (_USABLE | _C | _F)
        return _ARRAYS.get(asked) or _ARRAYS.setdefault(asked, _array(*asked))
    kind = getattr(value, "dtype", None)
    return type(value).__name__ if kind is None else str(kind.str)


def _array(kind: Any, axes: int, flags: int) -> str:
    if flags & _USABLE != _USABLE:
        return f"{kind.str}{axes} read only"
    return f"{kind.str}{axes}{'C' if flags & _C else 'F' if flags & _F else 'A'}"


def _fitted(value: Any, word: str, listed: str) -> Any:
    """Return an argument as another listed type; None if a kernel could compute otherwise."""
    if word == listed:
        return value
    if listed in _NUMBERS:
        return _NUMBERS[listed](value) if word in ("<i2", "<i4", "<i8") else None
    from numpy import array, ndarray

    if not isinstance(value, ndarray) or f"{value.dtype.str}{value.ndim}" != listed[:-1]:
        return None
    return array(value, order="F" if listed[-1] == "F" else "C", copy=True)


def _value(told: dict[str, Any]) -> Any:
    """Return the value described by the words of `compile_kernels`."""
    import numpy as np

    if "dtype" in told:
        return np.dtype(told["dtype"])
    if "type" in told:
        return np.ndarray
    kind = getattr(builtins, told["error"], None) or getattr(np.linalg, told["error"])
    if not issubclass(kind, Exception):
        raise TypeError(told["error"])
    arguments, where = told["arguments"], told["where"]
    return (
        kind,
        None if arguments is None else tuple(arguments),
        None if where is None else tuple(where),
    )


def _unpickled(_address: int, data: bytes, _hashed: bytes) -> Any:
    """Stand for the function of that name that numba's library calls; nothing here is pickled."""
    return _value(json.loads(data))


def _with_arguments(static: bytes, arguments: Sequence[Any]) -> Any:
    """Return an error with arguments computed only when it is raised; as above."""
    kind, known, where = _value(json.loads(static))
    later = iter(arguments)
    return kind, tuple(next(later) if one == {"later": True} else one for one in known), where


def _extension(folder: Path, name: str) -> ModuleType:
    file = folder / f"{name.rpartition('.')[2]}{EXTENSION_SUFFIXES[0]}"
    spec = spec_from_loader(name, ExtensionFileLoader(name, str(file)))
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} cannot be loaded")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class _Unneeded:
    """Stands for a compiler: each access returns itself, also as a base class."""

    def __init__(self, *_: Any) -> None:
        """Take anything."""

    def __call__(self, *_: Any, **__: Any) -> _Unneeded:
        """Answer with itself."""
        return self

    def __getattr__(self, name: str) -> _Unneeded:
        """Answer with itself; Python's own questions are not answered."""
        if name.startswith("__"):
            raise AttributeError(name)
        return self


def install(folder: Path, kind: str) -> Kernels:
    """Put what serves the kernels of the package in the place of numba and llvmlite.

    Parameters
    ----------
    folder
        Where the libraries are.
    kind
        Of processor.
    """
    kernels = Kernels(folder, kind)
    # Without LLVM there is no query of the choice.
    os.environ.update(cpu_features.environment(kind))
    unneeded = _Unneeded()

    def njit(*functions: Callable[..., Any], **_: Any) -> Any:
        return Kernel(kernels, functions[0]) if functions else lambda one: Kernel(kernels, one)

    names: dict[str, dict[str, Any]] = {
        "numba": {"njit": njit},
        "numba.core.event": {"Listener": object, "install_listener": lambda *_: nullcontext()},
        "numba.core.serialize": {
            "_numba_unpickle": _unpickled,
            "runtime_build_excinfo_struct": _with_arguments,
        },
    }
    for name in (
        "numba", "numba.core", "numba.core.event", "numba.core.serialize", "numba.core.types",
        "numba.core.typing", "numba.core.typing.templates", "numba.extending", "llvmlite",
        "llvmlite.ir",
    ):  # fmt: skip
        module = ModuleType(name)
        vars(module).update(names.get(name, {}), __path__=[], __getattr__=unneeded.__getattr__)
        sys.modules[name] = module
        parent, _, last = name.rpartition(".")
        if parent:
            setattr(sys.modules[parent], last, module)
    return kernels
