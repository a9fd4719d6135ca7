"""Hands at the instrument: who shows frames to a guided procedure, on a thread of its own.

In: a source of frames, made when it is wanted, and a procedure that says what it wants. Out: frames
for whoever watches, until everything is shown or nobody watches any more.

Read `_hand` (how every hand starts, stops and fails), then `_test_hand` (acceptance tests: at the
virtual rig and from a recording) and `_practice_hand` (wizards that are practised).
It must not know rigs, scenes or stations: the composition gives it what to show.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.composition.hands._hand import Hand
    from ocmm_core.composition.hands._practice_hand import PracticeHand
    from ocmm_core.composition.hands._test_hand import RecordedHand, TestHand, VirtualHand
else:
    __getattr__ = door(
        __name__,
        _hand="Hand",
        _practice_hand="PracticeHand",
        _test_hand="RecordedHand TestHand VirtualHand",
    )

__all__ = ["Hand", "PracticeHand", "RecordedHand", "TestHand", "VirtualHand"]
