"""A disk that fails on demand: any writing system call can return an error.

A small preloaded C library (``LD_PRELOAD``) counts the calls on files below one folder and fails
one of them, or all from one on. It also counts what must never happen: fsync retried on a
descriptor after a failure.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ocmm_bench.campaign._trials import NotRunError, Trial
from ocmm_core.documents import resource

CALLS = (
    "open", "write", "pwrite", "fsync", "fdatasync", "ftruncate", "rename", "link", "unlink",
    "mkdir",
)  # fmt: skip
"""Calls that can fail, in the order of the library."""

FAULTY_DISK = resource("selftest", "faulty_disk.c").read_text("utf-8")


def why_not_here() -> str:
    """Return why this computer cannot make such a disk; empty if it can."""
    if sys.platform != "linux":
        return "needs Linux"
    return "" if shutil.which("cc") else "needs a C compiler, cc"


def build(folder: Path, text: str = FAULTY_DISK) -> Path:
    """Compile a preloadable library into a folder and return its path."""
    source, library = folder / "before_system.c", folder / "before_system.so"
    source.write_text(text, encoding="utf-8")
    subprocess.run(  # noqa: S603 - the compiler of this computer and our own source
        [str(shutil.which("cc")), "-O1", "-shared", "-fPIC", "-o", library, source, "-ldl"],
        check=True,
    )
    return library


def with_faults(library: Path) -> dict[str, str]:
    """Return the environment that preloads such a library."""
    return {**os.environ, "LD_PRELOAD": str(library)}


def served(
    lane: str, text: str, serve: str, order: tuple[int, int, frozenset[int]], prelude: str = ""
) -> Iterator[Trial]:
    """Yield the trials of a lane run by a separate program with a preloaded library, from its text.

    ``serve``: public function of this package that prints ``[number, acknowledged, found, note]``
    of each trial, given ``order``: seed, number of trials, finished trials; and a working folder.
    ``prelude`` is code to run first. NotRunError: the library cannot be made here.
    """
    lacking = why_not_here()
    if lacking:
        raise NotRunError(lacking)
    seed, runs, done = order
    with tempfile.TemporaryDirectory() as folder:
        program = subprocess.Popen(  # noqa: S603 - this program again
            [
                sys.executable, "-c",
                f"{prelude}import ocmm_bench.campaign as campaign; campaign.{serve}()",
                json.dumps([seed, runs, sorted(done), folder]),
            ],
            env=with_faults(build(Path(folder), text)), stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert program.stdout is not None  # noqa: S101 - it is a pipe
        with program:
            try:
                for line in program.stdout:
                    number, acknowledged, found, note = json.loads(line)
                    yield Trial(lane, seed, number, acknowledged, found, note)
            finally:
                program.kill()


class FaultyDisk:
    """The library in a process that was started `with_faults`."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL(os.environ["LD_PRELOAD"])

    def fail(self, folder: Path, call: str, nth: int, code: int, *, stay: bool) -> None:
        """Fail the ``nth`` call of a kind below a folder, or all from it on."""
        number = CALLS.index(call) if call else -1
        self._library.ocmm_fault(os.fsencode(folder), number, ctypes.c_long(nth), code, int(stay))

    def mend(self) -> None:
        """Stop failing calls."""
        self._library.ocmm_fault(b"", -1, ctypes.c_long(-1), 0, 0)

    def counts(self) -> dict[str, int]:
        """Return the number of each call since `fail`."""
        return {name: int(self._library.ocmm_count(at)) for at, name in enumerate(CALLS)}

    def hits(self) -> int:
        """Return the number of failed calls since `fail`."""
        return int(self._library.ocmm_hits())

    def synced_again(self) -> int:
        """Return the number of fsync retries after a failed one."""
        return int(self._library.ocmm_again())
