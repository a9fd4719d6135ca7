"""Does the bus survive every fault? All faults on the real bus process, timed against the limits.

Prints a table - what was reported, after how many cycles, how long until operation again, frames
lost and frames that must not have been given out - then lost answers against the log of the
cable, rapid starts and stops, restarts, links that flap, inputs that are exchanged, copied, old or
damaged on the wire, and what other masters say of the cameras. Ends with 1 where a limit
is broken. Run: ``python -m benchmarks.faults [STARTS]``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec

from benchmarks.fault_identity import Identity
from benchmarks.fault_list import SCENARIOS
from benchmarks.fault_restarts import Flaps, Restarts, Starts
from benchmarks.fault_scenarios import Outcome
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.wire import namespace_command

STARTS = 1000
FLAG_LIMIT_CYCLES = 3.0
_RIGS = 4
BACK_LIMIT_S = 2.0
_FOLDER = Path(__file__).parent
_DATA_STAY = {"emergency message", "request to a camera whose mailbox hangs",
              "request that is refused"}  # fmt: skip
"""Nothing is wrong with the data, so nothing has to be flagged at once."""


def inside(program: str, *arguments: str) -> bytes:
    """Run a program of this folder in a private network namespace; return its output."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result.json"
        environment = {**os.environ, "PYTHONPATH": str(_FOLDER.parent)}
        subprocess.run(  # noqa: S603 - our own interpreter and programs, no shell
            [*namespace_command(), sys.executable, str(_FOLDER / program), str(out), *arguments],
            check=True,
            env=environment,
        )
        return out.read_bytes()


def at_once(what: str, count: int) -> list[bytes]:
    """Play something on several virtual wires at once: most of its time is spent waiting."""
    with ThreadPoolExecutor(_RIGS) as pool:
        shares = [str(count // _RIGS + (rig < count % _RIGS)) for rig in range(_RIGS)]
        return list(pool.map(lambda share: inside("fault_scenarios.py", what, share), shares))


def broken(outcome: Outcome, *, stops: bool, answer: str) -> list[str]:
    """Return which limits an outcome breaks."""
    found = []
    flagged = outcome.flagged_cycles
    late = flagged is None or flagged > FLAG_LIMIT_CYCLES
    if stops and outcome.name not in _DATA_STAY and late:
        found.append("flagged late")
    if outcome.back_s is None or outcome.back_s > BACK_LIMIT_S:
        found.append("back late")
    if outcome.wrong or (stops and outcome.accepted):
        found.append("wrong frames")
    if not outcome.named or outcome.answer != answer:
        found.append("not named")
    if not outcome.running:
        found.append("ended")
    return found


def row(outcome: Outcome) -> str:
    """Return the row of the table."""
    flagged = "-" if outcome.flagged_cycles is None else f"{outcome.flagged_cycles:.1f}"
    back = "never" if outcome.back_s is None else f"{outcome.back_s:.2f}"
    codes = " ".join(dict.fromkeys(code.removeprefix("bus.") for code in outcome.reported))
    return (
        f"{outcome.name:46} {flagged:>8} {back:>7} {outcome.frames_lost:>8} {outcome.wrong:>6}  "
        f"{codes}"
    )


def main() -> int:
    """Run everything and return the exit code."""
    starts = int(sys.argv[1]) if len(sys.argv) > 1 else STARTS
    failed = 0
    print(f"{'fault':46} {'cycles':>8} {'back s':>7} {'lost':>8} {'wrong':>6}  reported")
    outcomes = msgspec.json.decode(inside("fault_scenarios.py", "faults"), type=list[Outcome])
    for scenario, outcome in zip(SCENARIOS, outcomes, strict=True):
        complaints = broken(outcome, stops=scenario.stops, answer=scenario.answer)
        failed += bool(complaints)
        print(row(outcome), *(f"<- {complaint}" for complaint in complaints))
    print(
        f"limits: {FLAG_LIMIT_CYCLES:.0f} cycles where data must stop, "
        f"{BACK_LIMIT_S:.0f} s, 0 wrong"
    )
    (exact,) = msgspec.json.decode(inside("fault_scenarios.py", "exact"), type=list[Outcome])
    print(
        f"one camera, 1 % of the answers dropped: {exact.cycles_spoiled} by the cable, "
        f"{exact.lost} lost by the bus process ({exact.stray} came too late by themselves), "
        f"{exact.frames_lost} frames lost"
    )
    failed += not exact.cycles_spoiled <= exact.lost <= exact.cycles_spoiled + exact.stray
    content = inside("fault_scenarios.py", "starts", str(starts))
    done = msgspec.json.decode(content, type=Starts)
    print(
        f"rapid starts: {done.count}, {done.ended} ended when asked "
        f"(slowest {done.slowest_stop_s:.2f} s), "
        f"{done.measured} gave frames ({done.frames}, {done.wrong} wrong), "
        f"left over: {done.descriptors} descriptors, {done.threads} threads",
        *done.messages,
    )
    left_over = done.descriptors + done.threads
    failed += done.ended != starts or done.wrong > 0 or not done.works or bool(left_over)
    for content in at_once("restarts", starts):
        books = msgspec.json.decode(content, type=Restarts)
        print(
            f"restarts: {books.count} ({books.of_cameras} of all cameras by killing them, "
            f"{books.of_the_bus} of the bus process), {books.back} times back in operation; "
            f"{books.elapsed} cycles in the books, {books.passed:.0f} by the clock; read "
            f"{books.looks} times, not in one account each: {books.torn}",
            books.message,
        )
        failed += books.torn > 0 or books.back != books.count + 1
    for content in at_once("flaps", starts):
        flaps = msgspec.json.decode(content, type=Flaps)
        print(
            f"link flaps: {flaps.count}, {flaps.back} times frames again; {flaps.frames} frames, "
            f"{flaps.wrong} wrong; not in one account each: {flaps.torn}"
        )
        failed += flaps.back != flaps.count or flaps.wrong > 0 or flaps.torn > 0
    content = inside("fault_scenarios.py", "identity", str(100 * starts))
    for kind in msgspec.json.decode(content, type=list[Identity]):
        print(
            f"cycles with {kind.kind} inputs: {kind.refused} refused, {kind.good} good ones; "
            f"{kind.frames} frames, {kind.wrong} wrong; not in one account each: {kind.torn}"
        )
        failed += kind.wrong > 0 or kind.torn > 0 or kind.refused < 25 * starts
    for master in ("kickcat", "pysoem"):
        wrong = msgspec.json.decode(inside("esi_agreement.py", master), type=list[str])
        print(f"{master}: in operation, differences from the ESI file: {len(wrong)}", *wrong[:5])
        failed += bool(wrong)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)
