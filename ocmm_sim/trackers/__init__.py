"""Software tracker: markers of the virtual rig with the noise of a document, by OpenIGTLink.

In: frames of a virtual rig, the document of a tracker. Out: messages of a tracker; faults on
request.

Read `_device` (markers and their errors), `_server` (messages, faults), then `_virtual` (the
virtual rig in a private network namespace). It must not import the receiver of the messages, except
for its start and the checksum.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_sim.trackers._device import MarkerErrors, SoftwareTracker
    from ocmm_sim.trackers._server import IgtlEncoder, IgtlServer, Kind, TrackerFaults, message
    from ocmm_sim.trackers._virtual import virtual_tracker_feed
else:
    __getattr__ = door(__name__)

__all__ = [
    "IgtlEncoder", "IgtlServer", "Kind", "MarkerErrors", "SoftwareTracker", "TrackerFaults",
    "message", "virtual_tracker_feed",
]  # fmt: skip
