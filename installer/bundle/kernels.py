"""Which of the kernels that the package holds this computer runs.

The package holds them for a processor with AVX2 and for any x86-64 one, see `linked`.
"""

from __future__ import annotations

import os
from pathlib import Path

AVX2, GENERIC = "haswell", "generic"
"""As LLVM calls them; the suite is run with both (`tests.processor`)."""
KINDS = (AVX2, GENERIC)
_NEEDED = frozenset({"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "popcnt", "lzcnt"})


def processor_kind(cpuinfo: str) -> str:
    """Return which kernels a computer can run.

    Parameters
    ----------
    cpuinfo
        The text of /proc/cpuinfo; of several processors the least counts.
    """
    processors = [
        # Linux names lzcnt by the group that it came with.
        {"lzcnt" if flag == "abm" else flag for flag in line.partition(":")[2].split()}
        for line in cpuinfo.splitlines()
        if line.startswith("flags")
    ]
    return AVX2 if processors and all(flags >= _NEEDED for flags in processors) else GENERIC


def environment(kind: str) -> dict[str, str]:
    """Return what numba must find in its environment, before it is imported, to compile a kind."""
    # Empty: the features of that processor; without it those of this one are in the key.
    return {"NUMBA_CPU_NAME": kind, "NUMBA_CPU_FEATURES": ""}


def choose() -> tuple[str, str]:
    """Return the kind of kernels for this computer, and a sentence where it is not the best one.

    ``NUMBA_CPU_NAME``, which numba reads in a clone, may ask for those that run on any processor.
    """
    try:
        kind = processor_kind(Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        kind = GENERIC
    asked = os.environ.get("NUMBA_CPU_NAME", kind)
    if asked not in KINDS:
        return kind, f"There are no kernels for a processor '{asked}': those for '{kind}' are used."
    if asked == kind == AVX2:
        return AVX2, ""
    if kind == GENERIC:
        return GENERIC, (
            "This processor has no AVX2: the kernels for any processor are used, which are slower."
        )
    return (
        GENERIC,
        "The kernels for any processor are used, as NUMBA_CPU_NAME asks; they are slower.",
    )
