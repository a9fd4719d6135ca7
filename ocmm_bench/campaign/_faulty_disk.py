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

CALLS = (
    "open", "write", "pwrite", "fsync", "fdatasync", "ftruncate", "rename", "link", "unlink",
    "mkdir",
)  # fmt: skip
"""Calls that can fail, in the order of the library."""

FAULTY_DISK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { OPEN, WRITE, PWRITE, FSYNC, FDATASYNC, FTRUNCATE, RENAME, LINK, UNLINK, MKDIR, CALLS };
static char folder[4096];
static long counts[CALLS], nth = -1, hits, again;
static int wanted = -1, code, stay;
static unsigned char failed[65536];

void ocmm_fault(const char *below, int call, long number, int error, int on)
{
    snprintf(folder, sizeof folder, "%s", below);
    memset(counts, 0, sizeof counts);
    wanted = call; nth = number; code = error; stay = on; hits = again = 0;
}
long ocmm_count(int call) { return counts[call]; }
long ocmm_hits(void) { return hits; }
long ocmm_again(void) { return again; }

static int below(const char *path)
{
    return folder[0] && path && strncmp(path, folder, strlen(folder)) == 0;
}
static int fd_below(int fd)
{
    char link[64], path[4096];
    if (!folder[0] || fd < 0) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    if (n < 0) return 0;
    path[n] = 0;
    return below(path);
}
/* Whether this call shall fail. */
static int fails(int call)
{
    long number = ++counts[call];
    if (call != wanted || !(number == nth || (stay && number > nth))) return 0;
    hits++;
    errno = code;
    return 1;
}
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define SYNC(name, call) \
    int name(int fd) \
    { \
        if (fd_below(fd)) { \
            if (fd < 65536 && failed[fd]) again++; \
            if (fails(call)) { if (fd < 65536) failed[fd] = 1; return -1; } \
        } \
        return REAL(name)(fd); \
    }
SYNC(fsync, FSYNC)
SYNC(fdatasync, FDATASYNC)
int close(int fd)
{
    if (fd >= 0 && fd < 65536) failed[fd] = 0;
    return REAL(close)(fd);
}
#define OPENER(name) \
    int name(const char *path, int flags, ...) \
    { \
        mode_t mode = 0; \
        if (flags & (O_CREAT | __O_TMPFILE)) { \
            va_list a; va_start(a, flags); mode = va_arg(a, mode_t); va_end(a); \
        } \
        if ((flags & (O_WRONLY | O_RDWR)) && below(path) && fails(OPEN)) return -1; \
        return REAL(name)(path, flags, mode); \
    }
OPENER(open)
OPENER(open64)
ssize_t write(int fd, const void *content, size_t n)
{
    if (fd_below(fd) && fails(WRITE)) return -1;
    return REAL(write)(fd, content, n);
}
#define PWRITER(name, type) \
    ssize_t name(int fd, const void *content, size_t n, type at) \
    { \
        if (fd_below(fd) && fails(PWRITE)) return -1; \
        return REAL(name)(fd, content, n, at); \
    }
PWRITER(pwrite, off_t)
PWRITER(pwrite64, off64_t)
#define TRUNCATER(name, type) \
    int name(int fd, type n) \
    { \
        if (fd_below(fd) && fails(FTRUNCATE)) return -1; \
        return REAL(name)(fd, n); \
    }
TRUNCATER(ftruncate, off_t)
TRUNCATER(ftruncate64, off64_t)
#define NAMER(name, call) \
    int name(const char *from, const char *to) \
    { \
        if (below(to) && fails(call)) return -1; \
        return REAL(name)(from, to); \
    }
NAMER(rename, RENAME)
NAMER(link, LINK)
int unlink(const char *path)
{
    if (below(path) && fails(UNLINK)) return -1;
    return REAL(unlink)(path);
}
int mkdir(const char *path, mode_t mode)
{
    if (below(path) && fails(MKDIR)) return -1;
    return REAL(mkdir)(path, mode);
}
"""


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
