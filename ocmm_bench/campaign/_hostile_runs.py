"""Real commands in separate processes, and forbidden outcomes."""

from __future__ import annotations

import contextlib
import os
import runpy
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from ocmm_bench.campaign._hostile_forge import Forgery

LONGEST_S, LONGEST_CLOCK_S, MOST_MB = 5.0, 120.0, 512.0
REFUSED = 2
_LONGEST_ANSWER = 4000
_NOBODY = 65534


@dataclass(frozen=True, slots=True)
class CommandResult:
    """Result of a command: exit code, CPU and wall time, memory, output."""

    code: int
    cpu_s: float
    clock_s: float
    memory_mb: float
    words: str

    def fault(self, kind: Forgery, usual_s: float) -> str:
        """Return the forbidden outcome or "": a good file takes ``usual_s`` of CPU time."""
        if self.code == -signal.SIGKILL or self.cpu_s > 2.0 * usual_s + LONGEST_S:
            return "hang"
        if self.code not in (0, 1, REFUSED) or "Traceback" in self.words:
            return "traceback"
        if self.memory_mb > MOST_MB:
            return "memory"
        said = self.words.partition("ocmm: ")[2]
        if self.code == REFUSED and not 10 < len(said) < _LONGEST_ANSWER:
            return "no sentence"
        return "" if kind.harmless or self.code == REFUSED else "accepted"


def run_here(arguments: list[str]) -> None:
    """Run a command in this process, so that forked children have everything loaded."""
    before, sys.argv = sys.argv, ["ocmm", *arguments]
    try:
        with contextlib.suppress(SystemExit):
            _run()
    finally:
        sys.argv = before


def ordinary_user() -> int | None:
    """Return a user without rights if this is root, and that user can run this program."""
    if os.getuid() != 0:
        return None
    child = os.fork()
    if child == 0:
        _give_up_rights(_NOBODY)
        os._exit(int(not all(os.access(one, os.R_OK) for one in (__file__, contextlib.__file__))))
    return _NOBODY if os.waitpid(child, 0)[1] == 0 else None


def _give_up_rights(user: int) -> None:
    os.setgroups([])
    os.setgid(user)
    os.setuid(user)


def run_aside(
    arguments: list[str], words: Path, most_s: float = LONGEST_CLOCK_S, user: int | None = None
) -> CommandResult:
    """Run a command as ``user`` (None: this one), killed after ``most_s``; prints to ``words``."""
    sys.stdout.flush()
    sys.stderr.flush()
    begun = time.perf_counter()
    child = os.fork()
    if child == 0:
        _become(arguments, words, user)
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.perf_counter() - begun > most_s:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.005)
    text = words.read_text("utf-8", "replace") if words.exists() else ""
    return CommandResult(
        os.waitstatus_to_exitcode(status),
        used.ru_utime + used.ru_stime,
        time.perf_counter() - begun,
        used.ru_maxrss / 1024.0,
        text,
    )


def _become(arguments: list[str], words: Path, user: int | None) -> None:
    """Become the command; never returns."""
    target = os.open(words, os.O_WRONLY | os.O_CREAT, 0o600)
    os.dup2(target, 1)
    os.dup2(target, 2)
    if user is not None:
        _give_up_rights(user)
    sys.argv = ["ocmm", *arguments]
    code = 0
    try:
        _run()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException as error:
        sys.stderr.write(f"Traceback {error!r}\n")
        code = 3
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _run() -> None:
    # As a user starts it; no package of commands knows all of them.
    runpy.run_module("ocmm_cli", run_name="__main__")
