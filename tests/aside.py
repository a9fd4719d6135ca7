"""Run a command behind what measures time: ``python -m tests.aside COMMAND...``.

Of a core that both want it gets a quarter, and so does all that it starts; what the other leaves is
all its own. Not less: beside other programs a test of some seconds must not take minutes. It ends
with the shell that started it. The exit code is that of the command.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_NICER = 5
"""Linux weighs 1024 against 335."""
_PR_SET_PDEATHSIG = 1


def main(*command: str) -> int:
    """Replace this process by the command; return only where there is none."""
    if command:
        os.nice(_NICER)
        # A shell lets its background ignore them, and so would what a test starts to interrupt.
        for interrupt in (signal.SIGINT, signal.SIGQUIT):
            signal.signal(interrupt, signal.SIG_DFL)
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        os.execvp(command[0], command)  # noqa: S606 - the caller's own command
    sys.stderr.write(f"{__doc__}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
