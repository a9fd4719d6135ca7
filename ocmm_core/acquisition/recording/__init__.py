"""Raw frames on the disk: recorded, played back, or taken from recorded network traffic.

In: frames of any source, a recording, or a file of tcpdump or tshark (pcap, pcapng).
Out: a recording on the disk, or frames again, as a source like any other.

Read `_recording` (the file format and its reader) and `_recorder` (writing, and replay as a
source); `_history` keeps the last seconds in memory. Then the other way in: `_packets` reads
traffic files, `_capture_layout` learns from a recorded bring-up where the data of each camera are,
`_capture` takes the frames out.
It must not know the bus process, and nothing of labels or poses: a recording holds raw spots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.acquisition.recording._capture import BusCapture, CaptureAccount
    from ocmm_core.acquisition.recording._history import HISTORY_S, FrameHistory
    from ocmm_core.acquisition.recording._recorder import FrameRecorder, ReplaySource
else:
    __getattr__ = door(
        __name__,
        _capture="BusCapture CaptureAccount",
        _history="FrameHistory HISTORY_S",
        _recorder="FrameRecorder ReplaySource",
    )

__all__ = [
    "HISTORY_S",
    "BusCapture",
    "CaptureAccount",
    "FrameHistory",
    "FrameRecorder",
    "ReplaySource",
]
