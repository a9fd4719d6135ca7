"""Raw frames on the disk: recorded, played back, or taken from recorded network traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.acquisition.recording._capture import BusCapture, CaptureAccount
    from ocmm_core.acquisition.recording._recorder import FrameRecorder, ReplaySource
else:
    __getattr__ = door(
        __name__,
        _capture="BusCapture CaptureAccount",
        _recorder="FrameRecorder ReplaySource",
    )

__all__ = [
    "BusCapture",
    "CaptureAccount",
    "FrameRecorder",
    "ReplaySource",
]
