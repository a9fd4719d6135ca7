"""Processes that run a guided test as the window does until they are killed; they print each point.

One process loads everything and forks a child for each line ``NUMBER FOLDER`` that it reads. A
child resumes the test that is offered, or starts one; the virtual hand presents the artefact on its
own thread. After one point more than the number the child waits: a kill meets it in the last step
or after it, however fast the computer is.
"""

from __future__ import annotations

import os
import sys
import threading
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.acceptance import AcceptanceProcedure
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.composition import AcceptanceBench, StatedConditions, StationRequest
from ocmm_core.documents import resource
from tests.core.acceptance.acceptance_site import ROOM
from tests.slow_rig import CALM_HZ, slow_rig_in

NAME = "EFFECTIVE-DIAMETER"


def bench_in(folder: Path) -> AcceptanceBench:
    folder.mkdir(parents=True, exist_ok=True)
    request = StationRequest(
        plan=resource("plans", "quick.toml"), out=folder / "job", speed=0.0, frame_rate_hz=800,
        rig=slow_rig_in(folder, CALM_HZ),
    )  # fmt: skip
    return AcceptanceBench(request, folder=folder / "tests", register=folder / "artefacts")


def say(text: str) -> None:
    os.write(1, f"{text}\n".encode())


def opened(bench: AcceptanceBench) -> AcceptanceProcedure:
    now = datetime.now(UTC)
    left = bench.unfinished(now)
    if left:
        return bench.resume(left[0].path, ROOM)
    offer = next(one for one in bench.procedures(now) if one.procedure.id == NAME)
    used = tuple(one.used for one in bench.offers(offer, now, ROOM)[:1])
    return bench.start(offer, used, StatedConditions(who="Ann"), now)


def work(wanted: int, folder: Path) -> None:
    bench = bench_in(folder)
    procedure = opened(bench)
    over = threading.Event()
    taken = 0
    say(f"begun {os.getpid()} {procedure.base.step.done}")
    if procedure.base.step.name == "prepare":
        procedure.advance(datetime.now(UTC))

    def watch(block: FrameBlock) -> None:
        nonlocal taken
        if taken > wanted:
            return
        procedure.watch(block)
        if procedure.ready:
            procedure.record(datetime.now(UTC))
            taken += 1
            say(f"taken {sum(procedure.view.test.done)}")

    hand = bench.hand(procedure, lambda error: say(f"failed {error.what}"))
    assert hand is not None
    hand(watch)
    over.wait()
    hand(None)


if __name__ == "__main__":
    for line in sys.stdin:
        number, path = line.rstrip("\n").split(" ", 1)
        child = os.fork()
        if not child:
            work(int(number), Path(path))
            os._exit(0)
        os.waitpid(child, 0)
        say("ended")
