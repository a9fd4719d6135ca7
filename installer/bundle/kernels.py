"""Which of the kernels that the package holds this computer runs.

The package holds them for a processor with AVX2 and for any x86-64 one, see `linked`.
"""

from __future__ import annotations

import os
from pathlib import Path

from ocmm_core.cpu_features import AVX2, GENERIC, KINDS, kind_of

_CALLED_OTHERWISE = {"abm": "lzcnt", "bmi1": "bmi"}
"""Linux's name of a feature, and LLVM's."""


def processor_kind(cpuinfo: str) -> str:
    """Return which kernels a computer can run.

    Parameters
    ----------
    cpuinfo
        The text of /proc/cpuinfo; of several processors the least counts.
    """
    processors = [
        {_CALLED_OTHERWISE.get(flag, flag) for flag in line.partition(":")[2].split()}
        for line in cpuinfo.splitlines()
        if line.startswith("flags")
    ]
    # What all of them can.
    return kind_of(set.intersection(*processors) if processors else ())


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
