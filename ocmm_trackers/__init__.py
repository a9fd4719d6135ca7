"""Trackers as sources of frames: markers in space, by OpenIGTLink.

In: messages of a tracker. Out: spots of its equivalent cameras (`ocmm_core.camera`), in the
ring of a station.

Read `_igtl` (messages), `_stream` (bytes to messages, with an account), `_frames` (markers to
frames), `_proof` (unit and axes by the probe), `_source`, `_process`, `_feed` and `_specs` (the
entry of `ocmm.sources`). It must not import virtual trackers.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_trackers._feed import tracker_config
    from ocmm_trackers._frames import FrameAccount, FrameBuilder, MarkerFrame
    from ocmm_trackers._igtl import (
        IDENTITY, DeviceStatus, MarkerPlace, Message, Pose, checksum, decode, fraction_of,
    )  # fmt: skip
    from ocmm_trackers._process import TrackerConfig, tracker_command, tracker_description
    from ocmm_trackers._proof import GeometryProof, judge_geometry
    from ocmm_trackers._source import IgtlSource
    from ocmm_trackers._specs import IGTL
    from ocmm_trackers._stream import MessageAccount, MessageStream
else:
    __getattr__ = door(__name__)

__all__ = [
    "IDENTITY", "IGTL", "DeviceStatus", "FrameAccount", "FrameBuilder", "GeometryProof",
    "IgtlSource", "MarkerFrame", "MarkerPlace", "Message", "MessageAccount", "MessageStream",
    "Pose", "TrackerConfig", "checksum", "decode", "fraction_of", "judge_geometry",
    "tracker_command", "tracker_config", "tracker_description",
]  # fmt: skip
