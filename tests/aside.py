"""Run a command at low priority, behind the timing tests: ``python -m tests.aside COMMAND...``.

On a contended core the command and its children get a quarter of the time, on an idle core all of
it. A smaller share would turn tests of seconds into minutes under load. The command ends with the
shell that started it. The exit code is that of the command.
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
    """Replace this process by the command; return only if no command is given."""
    if command:
        os.nice(_NICER)
        # A background shell ignores these signals, and so would the programs that tests interrupt.
        for interrupt in (signal.SIGINT, signal.SIGQUIT):
            signal.signal(interrupt, signal.SIG_DFL)
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        os.execvp(command[0], command)  # noqa: S606 - the caller's own command
    sys.stderr.write(f"{__doc__}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
