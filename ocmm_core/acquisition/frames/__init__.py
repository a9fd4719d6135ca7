"""Frames of all cameras per exposure, their ring, and the worker that fills it.

In: blocks from a source: spots of each camera with the time of their exposure.
Out: the same frames in a ring of fixed size, for one reader, and cycle counters.

Start with `_frames` (contents, protocol of all sources), `_ring` (shared memory, overruns and
cycles counted), then `_worker` (source to ring). `_join` joins the cameras per exposure, and counts
across bring-ups; it also interpolates frames of cameras that do not expose together.

It must not depend on the kind of source: bus, virtual rig and replay are equivalent.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.acquisition.frames._frames import (
        SUBPIXEL, Cycle, CycleVerdict, FrameBlock, FrameFlag, FrameSource, SourceDescription,
        frame_dtype, from_records, quantise, to_records,
    )  # fmt: skip
    from ocmm_core.acquisition.frames._join import (
        MOST_FRAMES, ExposureCount, FrameAligner, FrameJoiner, Given,
    )  # fmt: skip
    from ocmm_core.acquisition.frames._ring import Books, FrameRing, RingHeaderField
    from ocmm_core.acquisition.frames._worker import (
        AcquisitionState, AcquisitionStatus, AcquisitionWorker, StopReason, leave_error,
        read_status,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MOST_FRAMES", "SUBPIXEL", "AcquisitionState", "AcquisitionStatus", "AcquisitionWorker",
    "Books", "Cycle", "CycleVerdict", "ExposureCount", "FrameAligner", "FrameBlock", "FrameFlag",
    "FrameJoiner", "FrameRing", "FrameSource", "Given", "RingHeaderField", "SourceDescription",
    "StopReason", "frame_dtype", "from_records", "leave_error", "quantise", "read_status",
    "to_records",
]  # fmt: skip
