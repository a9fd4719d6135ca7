"""Button events of the probe for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag


@dataclass(frozen=True, slots=True)
class ButtonChange:
    event: Literal["press", "release"]
    frame: int
    time_s: float
    """`frame`, `time_s`: Exposure of its first detection, and its bus time, s."""
    held_s: float | None = None
    """Of a release: duration; None if the press was not seen, and for a press."""


class ButtonWatch:
    """Find every change of the button in consecutive frames; for one thread.

    After missing frames a change is reported with the first frame. A button that is down in the
    very first frame was pressed before, and only its release is reported.
    """

    def __init__(self) -> None:
        self._down: bool | None = None
        self._since_s: float | None = None

    def feed(self, block: FrameBlock) -> list[ButtonChange]:
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
                # A bus clock reset meanwhile invalidates the duration.
                held_s = None if since_s is None or time_s < since_s else time_s - since_s
                changes.append(ButtonChange("release", frame, time_s, held_s))
        return changes
