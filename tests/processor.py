"""Run a command as on another processor: ``python -m tests.processor avx2|generic COMMAND...``.

``python -m tests.processor --others`` prints the processors for which the numerical tests are
repeated: the next one below this one, and with OCMM_TEST_LONG all.

Three libraries choose their instructions by the processor, each with its own switch, and the
command gets all three in addition to the environment; its exit code is returned. If this processor
cannot do it, the record is NOT RUN (`tests.gate`).
"""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

import numpy as np

from ocmm_core import cpu_features
from tests.gate import FAILED, NOT_RUN, RECORD, REQUIRE_ALL, Outcome, write_record
from tests.host import long_form

GENERIC, AVX2 = "generic", "avx2"
NAME = "OCMM_PROCESSOR"
# Names of numpy's dispatched groups; those before 2.4 are single instructions.
_UP_TO_AVX2 = {
    "SSE3", "SSSE3", "SSE41", "POPCNT", "SSE42", "AVX", "F16C", "FMA3", "AVX2", "X86_V2", "X86_V3",
}  # fmt: skip
# Of OpenBLAS and of LLVM. The oldest processor that numpy still starts on is a Nehalem.
_LIBRARIES = {AVX2: ("Haswell", cpu_features.AVX2), GENERIC: ("Nehalem", cpu_features.GENERIC)}


def emulation(processor: str) -> dict[str, str]:
    """Return the environment in which numerical libraries see another processor."""
    blas, compiled_for = _LIBRARIES[processor]
    kept = _UP_TO_AVX2 if processor == AVX2 else set()
    emulated = {
        NAME: processor,
        "NPY_DISABLE_CPU_FEATURES": " ".join(
            sorted(name for name in _dispatched() if name not in kept)
        ),
        "OPENBLAS_CORETYPE": blas,
    } | cpu_features.environment(compiled_for)
    if compiled_for == cpu_features.kind_of_this():
        # The set-up has compiled all of it.
        return emulated
    # Two processes that compile the same function at the same time spoil its list of results,
    # which holds those of all processors.
    return emulated | {"NUMBA_CACHE_DIR": str(Path(sys.prefix) / f"ocmm-compiled-{processor}")}


def why_not(processor: str) -> str:
    """Return the reason why this host cannot do it; empty if it can."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return f"tests as processor '{processor}' need an x86-64 processor"
    if processor == AVX2 and _dispatched().isdisjoint(("AVX2", "X86_V3")):
        return "this processor has no AVX2"
    return ""


def _dispatched() -> set[str]:
    """Return what numpy chooses by the processor and this one has; of other names it warns."""
    return set(np.show_config(mode="dicts")["SIMD Extensions"].get("found", ()))


def others(*, every: bool) -> tuple[str, ...]:
    """Return as which processors to repeat what rounding could tip over."""
    if every:
        return AVX2, GENERIC
    # With wider instructions than AVX2 this processor adds up in another order than one with it.
    return (GENERIC,) if _dispatched() <= _UP_TO_AVX2 else (AVX2,)


def main(processor: str, *command: str) -> int:
    """Replace this process by the command; return only if that is impossible."""
    if (processor, *command) == ("--others",):
        sys.stdout.write(" ".join(others(every=long_form())) + "\n")
        return 0
    if processor not in _LIBRARIES or not command:
        sys.stderr.write(f"{__doc__}\n")
        return 2
    reason = why_not(processor)
    if not reason:
        os.environ.update(emulation(processor))
        os.execvp(command[0], command)  # noqa: S606 - the caller's own command
    strict = os.environ.get(REQUIRE_ALL, "") not in ("", "0")
    sys.stderr.write(f"NOT RUN: {reason}\n")
    if os.environ.get(RECORD):
        outcome = Outcome(f"processor {processor}", FAILED if strict else NOT_RUN, reason)
        write_record(Path(os.environ[RECORD]), [outcome])
    return 1 if strict else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
