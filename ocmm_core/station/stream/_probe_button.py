"""The button of the probe as it goes down and up, for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag


@dataclass(frozen=True, slots=True)
class ButtonChange:
    """The button went down or up."""

    event: Literal["press", "release"]
    """What it did."""
    frame: int
    time_s: float
    """`frame`, `time_s`: Exposure at which it was first seen so, and its bus time, s."""
    held_s: float | None = None
    """Of a release: how long it was down; None where the press was not seen, and of a press."""


class ButtonWatch:
    """Find every change of the button in the frames as they come; used by one thread.

    Where frames are missing a change is told with the first frame after them. A button that is down
    in the very first frame was pressed before, and only its release is told.
    """

    def __init__(self) -> None:
        self._down: bool | None = None
        self._since_s: float | None = None

    def feed(self, block: FrameBlock) -> list[ButtonChange]:
        """Return what the button did in a block of frames."""
        changes: list[ButtonChange] = []
        down = (block.flags & FrameFlag.BUTTON) != 0
        if self._down is None:
            self._down = bool(down[0])
        if bool(down.any()) == self._down == bool(down.all()):
            return changes
        for index, is_down in enumerate(down.tolist()):
            if is_down is self._down:
                continue
            self._down = is_down
            frame, time_s = int(block.counter[index]), float(block.time_ns[index]) * 1e-9
            if is_down:
                self._since_s = time_s
                changes.append(ButtonChange("press", frame, time_s))
            else:
                since_s, self._since_s = self._since_s, None
                # A bus clock that was set anew meanwhile tells nothing about the time between.
                held_s = None if since_s is None or time_s < since_s else time_s - since_s
                changes.append(ButtonChange("release", frame, time_s, held_s))
        return changes
