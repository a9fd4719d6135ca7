"""Raw frames on disk: recording, replay, and import of network captures.

In: frames of any source, a recording, or a file of tcpdump or tshark (pcap, pcapng).
Out: a recording on the disk, or frames from a replay source.

Start with `_recording` (file format and reader) and `_recorder` (writing, replay as a source, and
the last seconds in memory). For captures: `_packets` reads traffic files and learns
each camera's data position from a recorded bring-up, `_capture` extracts the frames.

It must not import the bus process, labels or poses: a recording holds raw spots.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.acquisition.recording._capture import BusCapture, CaptureAccount
    from ocmm_core.acquisition.recording._recorder import (
        HISTORY_S, FrameHistory, FrameRecorder, ReplaySource,
    )  # fmt: skip
    from ocmm_core.acquisition.recording._recording import Recording
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "HISTORY_S", "BusCapture", "CaptureAccount", "FrameHistory", "FrameRecorder", "Recording",
    "ReplaySource",
]  # fmt: skip
