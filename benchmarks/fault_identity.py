"""Inputs that are not what they seem, on the wire: exchanged, copied, old and damaged ones.

The cameras, or the cable, spoil a share of the cycles; every frame that the bus process gives out
says by itself which camera showed it and when.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from benchmarks.camera_faults import COPIED, EXCHANGED, SHARED, FaultKind
from benchmarks.fault_list import LEFT, RIGHT
from benchmarks.fault_rig import FaultRig
from benchmarks.faulty_line import FrameKind, LineRule, Trick
from ocmm_core.acquisition.frames import read_status
from ocmm_core.documents import write_atomic
from ocmm_core.errors import BusError
from tests.system.frame_watch import FrameWatch, Watched

_SHARE = 0.3
"""Share of the cycles: enough good ones in between keep the bus in operation."""
_POLL_S = 0.002
_LONGEST_S = 600.0
_PROCESS = (FrameKind.PROCESS,)


class Identity(msgspec.Struct, kw_only=True):
    """What became of spoiled cycles of one kind.

    Attributes
    ----------
    kind
        What was done.
    refused, good
        Cycles refused as bad, and good ones meanwhile.
    frames, wrong
        Given out, and those of them that must not have been.
    torn
        Looks at the books in which not every cycle had one account.
    """

    kind: str
    refused: int = 0
    good: int = 0
    frames: int = 0
    wrong: int = 0
    torn: int = 0


def play_identity(count: int, out: Path) -> None:
    """Spoil cycles until the given number was refused, a quarter of them of each kind."""
    found = []
    kinds: tuple[tuple[str, Callable[[FaultRig, bool], object]], ...] = (
        ("exchanged", lambda rig, on: _corrupt(rig, EXCHANGED + SHARED if on else 0)),
        ("copied", lambda rig, on: _corrupt(rig, COPIED + SHARED if on else 0)),
        ("old", lambda rig, on: _cable(rig, Trick.REPLAY, on)),
        ("damaged", lambda rig, on: _cable(rig, Trick.FLIP_DATA, on)),
    )
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        rig.start_bus()
        if rig.ring is None:
            raise BusError("rig.bus", "The bus process is not there.", "Start it.")
        watch = FrameWatch(rig.ring)
        for name, spoil in kinds:
            result, seen = Identity(kind=name), Watched()
            before = read_status(rig.ring)
            spoil(rig, True)
            end = time.monotonic() + _LONGEST_S
            while result.refused < count // len(kinds) and time.monotonic() < end:
                watch.look(seen)
                seen.exposed_us.clear()
                now = read_status(rig.ring)
                result.torn += now.elapsed != now.good + now.late + now.lost + now.bad
                # An old answer does not belong to its cycle, which counts as lost.
                result.refused = now.bad + now.lost - before.bad - before.lost
                result.good = now.good - before.good
                time.sleep(_POLL_S)
            spoil(rig, False)
            result.frames, result.wrong = seen.frames, seen.wrong
            found.append(result)
            write_atomic(out, msgspec.json.encode(found))


def _corrupt(rig: FaultRig, value: int) -> None:
    rig.command(FaultKind.CORRUPT, 0, value)


def _cable(rig: FaultRig, trick: Trick, on: bool) -> None:
    rule = LineRule(do=trick, share=_SHARE, kinds=_PROCESS)
    rig.line(*([rule] if on else []))
