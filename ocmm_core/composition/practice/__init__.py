"""Every guided procedure with a virtual hand: in folders of its own, and valid for nothing.

In: what a station was built from, and a procedure that somebody practises. Out: frames of a hand
that does what the step asks for.

Read `_practice` (folders, frames of the hand, one entry per procedure).
It must not know a window or a command.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.composition.practice._practice import PRACTICE_TIP, Practice, practice_folder
else:
    __getattr__ = door(__name__, _practice="PRACTICE_TIP Practice practice_folder")

__all__ = ["PRACTICE_TIP", "Practice", "practice_folder"]
