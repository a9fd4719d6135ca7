"""Virtual hands: threads that show frames to guided procedures.

In: a source of frames, opened on demand, and a procedure that requests touches.
Out: frames for a watcher, until everything is shown or the watcher leaves.

Read `_hand`: start, stop and failure, and acceptance tests, virtual and recorded. It must
not import rigs, scenes or stations: the composition passes what to show.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_core.composition.hands._hand import (
        BLOCK, IDLE_S, Hand, RecordedHand, TestHand, VirtualHand, Watcher,
    )  # fmt: skip
else:
    __getattr__ = door(__name__)

__all__ = ["BLOCK", "IDLE_S", "Hand", "RecordedHand", "TestHand", "VirtualHand", "Watcher"]
