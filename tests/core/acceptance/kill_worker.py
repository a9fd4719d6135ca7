"""Processes that record a test point by point until they are killed; they print stored points.

One process loads everything and forks a child for each line ``NUMBER PATH`` on its input, so that
fifty kills do not cost fifty starts. A child records one point more than the number and waits: a
kill hits it in or after the last step on computers of any speed.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from ocmm_core.acceptance import AcceptanceSession
from tests.core.acceptance.acceptance_site import Machine, begin


def say(text: str) -> None:
    os.write(1, f"{text}\n".encode())


def work(wanted: int, path: Path) -> None:
    session = AcceptanceSession.resume(path) if path.exists() else begin(path, "SPAT")
    machine = Machine(seed=sum(session.view.done), sigma=0.001)
    say(f"begun {os.getpid()} {sum(session.view.done)}")
    for _ in range(wanted + 1):
        machine.step(session)
        say(f"taken {sum(session.view.done)}")
    signal.pause()


for line in sys.stdin:
    child = os.fork()
    if not child:
        number, path = line.rstrip("\n").split(" ", 1)
        work(int(number), Path(path))
        os._exit(0)
    os.waitpid(child, 0)
    say("ended")
