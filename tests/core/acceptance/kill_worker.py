"""Processes that take a test point by point until they are killed; they say what they were told.

One process loads everything and forks a child for each path that it reads, so that fifty kills do
not cost fifty starts.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ocmm_core.acceptance import AcceptanceSession
from tests.core.acceptance.acceptance_site import Machine, begin


def say(text: str) -> None:
    os.write(1, f"{text}\n".encode())


def work(path: Path) -> None:
    session = AcceptanceSession.resume(path) if path.exists() else begin(path, "SPAT")
    machine = Machine(seed=sum(session.view.done), sigma=0.001)
    say(f"begun {os.getpid()} {sum(session.view.done)}")
    while session.current >= 0:
        machine.step(session)
        say(f"taken {sum(session.view.done)}")


for line in sys.stdin:
    child = os.fork()
    if not child:
        work(Path(line.strip()))
        os._exit(0)
    os.waitpid(child, 0)
    say("ended")
