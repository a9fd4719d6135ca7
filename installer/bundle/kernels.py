"""Which of the kernels that the package holds this computer runs.

numba keys its results by name and features of the processor. The package holds them for a processor
with AVX2 and for any x86-64 one, and the names that numba reads from the environment say which of
the two is asked for. `installer.bundle.locator` finds them.
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


def kernels_beside(file: Path, kind: str) -> Path:
    """Return the folder that holds what a file's functions were compiled to."""
    # Whoever names a processor names no other folder.
    return file.parent / "__pycache__" / kind.replace(os.sep, "_")


def environment(kind: str) -> dict[str, str]:
    """Return what numba must find in its environment, before it is imported, to use a kind."""
    return {
        "NUMBA_CPU_NAME": kind,
        # Empty: those of that processor; without it those of this one are in the key.
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_LOCATOR_CLASSES": "installer.bundle.locator.ShippedLocator,"
        "UserWideCacheLocator",
    }


def choose() -> str:
    """Ask for the kernels that fit this computer; return a sentence where they are slower ones.

    Whoever set ``NUMBA_CPU_NAME`` has chosen.
    """
    if "NUMBA_CPU_NAME" in os.environ:
        kind = os.environ["NUMBA_CPU_NAME"]
    else:
        try:
            kind = processor_kind(Path("/proc/cpuinfo").read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            kind = GENERIC
    for name, value in environment(kind).items():
        os.environ.setdefault(name, value)
    if kind == AVX2:
        return ""
    if kind == GENERIC:
        return (
            "This processor has no AVX2: the kernels for any processor are used, which are slower."
        )
    return f"No kernels are compiled for a processor '{kind}': each program compiles for itself."
