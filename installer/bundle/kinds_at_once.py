"""Compile for several kinds of processors what numba worked out once: part of `compile_kernels`.

numba reads a function, finds its types and writes it down for LLVM, which takes longer than what
LLVM makes of it. What it writes depends on no processor, so it is kept, and given to LLVM once more
for each further kind, in the same order and with the same passes.
"""

from __future__ import annotations

from typing import Any

_written: set[int] = set()
"""Libraries of numba, which live as long as the process, whose code was written once."""


def run_nothing() -> None:
    """Keep what LLVM is given, and have numba write no code for this process; call it at first.

    Nothing that is compiled here is called. LLVM changes a function while it writes its code, and
    in a clone numba builds it into others after that, so what is built into others is written
    before.
    """
    import llvmlite.binding as llvm
    from numba import _dynfunc
    from numba.core import cgutils
    from numba.core.codegen import JITCodeLibrary
    from numba.core.cpu import CPUContext

    linked = JITCodeLibrary._get_module_for_linking  # noqa: SLF001 - numba shows none of these

    def add_and_keep(library: Any, module: Any) -> None:
        library._raise_if_finalized()  # noqa: SLF001 - as above
        text, name = cgutils.normalize_ir_text(str(module)), module.name
        vars(library).setdefault("kept", []).append((text, name))
        parsed = llvm.parse_assembly(text)
        parsed.name = name
        parsed.verify()
        library.add_llvm_module(parsed)

    def as_in_a_clone(library: Any) -> Any:
        library._ensure_finalized()  # noqa: SLF001 - as above
        emitted(library, library._codegen._tm)  # noqa: SLF001 - as above
        return linked(library)

    def never_called(_: object, library: Any, told: Any, environment: Any) -> Any:
        library._ensure_finalized()  # noqa: SLF001 - as above
        module, name = told.lookup_module(), told.qualname
        return _dynfunc.make_function(module, name, "", 0, environment, (library,))

    JITCodeLibrary.add_ir_module = add_and_keep
    JITCodeLibrary._get_module_for_linking = as_in_a_clone  # noqa: SLF001 - as above
    JITCodeLibrary._finalize_specific = lambda _: None  # noqa: SLF001 - as above
    CPUContext.get_executable = never_called


def emitted(library: Any, machine: Any = None) -> bytes:
    """Return the code of a library for a machine, or nothing where that was written before.

    Parameters
    ----------
    library
        Of numba.
    machine
        Of LLVM; without it, code that may lie anywhere, which is written in any case.
    """
    import llvmlite.binding as llvm
    from numba.core import config

    codegen = library._codegen  # noqa: SLF001 - numba shows none of these
    if machine is None:
        # As made by numba, except for the code model.
        machine = llvm.Target.from_default_triple().create_target_machine(
            cpu=codegen.cpu if hasattr(codegen, "cpu") else codegen._get_host_cpu_name(),  # noqa: SLF001
            features=codegen._tm_features,  # noqa: SLF001 - as above
            opt=config.OPT,
            reloc="pic",
            codemodel="small",
        )
    elif id(library) in _written:
        return b""
    _written.add(id(library))
    library._ensure_finalized()  # noqa: SLF001 - as above
    code: bytes = machine.emit_object(library._final_module)  # noqa: SLF001 - as above
    return code


class Another:
    """What was compiled, compiled for another kind of processor.

    Parameters
    ----------
    kind
        As LLVM calls it; see `cpu_features.KINDS`.
    """

    def __init__(self, kind: str) -> None:
        from numba.core import config
        from numba.core.codegen import JITCPUCodegen

        asked = config.CPU_NAME, config.CPU_FEATURES
        # The features of that processor, as `cpu_features.environment` has it.
        config.CPU_NAME, config.CPU_FEATURES = kind, ""
        try:
            self._codegen = JITCPUCodegen(f"numba.{kind}")
        finally:
            config.CPU_NAME, config.CPU_FEATURES = asked
        self._codegen.cpu = kind
        self._made: dict[int, Any] = {}

    def library(self, first: Any) -> Any:
        """Return a library of numba, compiled for this kind, with all that it is built of."""
        from numba.core.compiler_lock import global_compiler_lock

        made = self._made.get(id(first))
        if made is None:
            import llvmlite.binding as llvm

            made = self._made[id(first)] = self._codegen.create_library(first.name)
            for text, name in first.kept:
                parsed = llvm.parse_assembly(text)
                parsed.name = name
                made.add_llvm_module(parsed)
            for one in first._linking_libraries:  # noqa: SLF001 - as above
                made.add_linking_library(self.library(one))
            with global_compiler_lock:
                made.finalize()
        return made
