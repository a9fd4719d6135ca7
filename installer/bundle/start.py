"""What the programs of the package begin with, before anything else is imported.

OCMM starts parts of itself as ``sys.executable -m MODULE``. In the package that is the program
``ocmm``, so it understands these words, for modules of OCMM alone. ``ocmm-acq`` holds rights and
understands one word: it is the bus process, or measures how late that would wake up.
"""

from __future__ import annotations

import multiprocessing
import os
import re
import runpy
import sys
from pathlib import Path

from installer.bundle import kernels, linked

_OURS = re.compile(r"ocmm_[a-z]+(\.\w+)*")


def run() -> None:
    """Run the program of this file, independent of its calling name, which anyone may choose."""
    (run_ocmm_acq if Path(sys.executable).name == "ocmm-acq" else run_ocmm)()


def run_ocmm() -> None:
    """Run ``ocmm``, or the requested part of OCMM."""
    told = _use_kernels()
    if getattr(sys, "frozen", False):
        os.environ["QT_PLUGIN_PATH"] = str(Path(_inside(), "PySide6/Qt/plugins"))
    # A frozen program would start itself again and again without this.
    multiprocessing.freeze_support()
    words = sys.argv[1:]
    # Python's own option; a frozen program is isolated as it is.
    if words[:1] == ["-I"]:
        words = words[1:]
    if len(words) > 1 and words[0] == "-m" and _OURS.fullmatch(words[1]):
        sys.argv = [sys.argv[0], *words[2:]]
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        return
    if told and sys.stderr is not None:
        sys.stderr.write(f"ocmm: {told}\n")
    from ocmm_cli import main

    main()


def run_ocmm_acq() -> None:
    """Be the bus process, or the measurement of the doctor that needs its rights."""
    _use_kernels()
    multiprocessing.freeze_support()
    module = "ocmm_core.acquisition.bus_process._start"
    if sys.argv[1:2] == ["--wake"] and len(sys.argv) == 4:
        del sys.argv[1]
        module = "ocmm_core.doctor._wake"
    runpy.run_module(module, run_name="__main__")


def _use_kernels() -> str:
    """Use the kernels of the package, if this is one; return a message for the user."""
    kind, told = kernels.choose()
    if not getattr(sys, "frozen", False):
        return ""
    linked.install(_inside() / "kernels", kind)
    return told


def _inside() -> Path:
    return Path(sys._MEIPASS)  # type: ignore[attr-defined] # noqa: SLF001 - PyInstaller's name for it
