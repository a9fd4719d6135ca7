"""All bugs of firmware that are planted into the software camera, see `bugs`."""

from __future__ import annotations

from tests.core.fieldbus.bugs import (
    clock_bugs,
    command_bugs,
    eeprom_bugs,
    error_bugs,
    frame_bugs,
    mailbox_bugs,
    object_bugs,
    state_bugs,
    update_bugs,
)
from tests.core.fieldbus.bugs.bug_tools import BUGS, Bug

PARTS = (
    eeprom_bugs, state_bugs, object_bugs, mailbox_bugs, frame_bugs, clock_bugs, error_bugs,
    command_bugs, update_bugs,
)  # fmt: skip
"""Each adds its own when it is imported."""
__all__ = ["BUGS", "PARTS", "Bug"]
