"""Software tracker: markers of the virtual rig with the noise of a document, by each protocol.

In: frames of a virtual rig, the document of a tracker. Out: messages of a tracker; faults on
request.

Read `_encoder` (what protocols share, faults, the server, streams) and `_ndi` (messages), then
`_virtual` (markers and their errors; the virtual rig in a private network namespace).
It must not import the receiver of the messages, except for its start and the checksums.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.trackers._encoder import (
        IgtlEncoder, Kind, MarkerEncoder, NatNetEncoder, QtmEncoder, TrackerFaults, TrackerServer,
        datagrams_of, message,
    )  # fmt: skip
    from ocmm_sim.trackers._ndi import NdiEncoder, Newest
    from ocmm_sim.trackers._virtual import MarkerErrors, SoftwareTracker, virtual_tracker_feed
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "IgtlEncoder", "Kind", "MarkerEncoder", "MarkerErrors", "NatNetEncoder", "NdiEncoder", "Newest",
    "QtmEncoder", "SoftwareTracker", "TrackerFaults", "TrackerServer", "datagrams_of", "message",
    "virtual_tracker_feed",
]  # fmt: skip
