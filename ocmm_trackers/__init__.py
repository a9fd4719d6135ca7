"""Trackers as sources of frames: markers in space, by the protocols of their makers.

In: messages of a tracker. Out: spots of its equivalent cameras (`ocmm_core.camera`), in the
ring of a station.

Read `_messages` (what all protocols have in common), the decoders `_igtl`,
`_motion_capture` and `_ndi`, then `_frames` (markers to frames, unit and axes by the probe),
`_link` (network and serial lines), `_source`, `_process`, `_feed` and `_specs` (the entries of
`ocmm.sources`). `_pose_file` computes tips from recordings of other programs.
It must not import virtual trackers.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_trackers._feed import tracker_config
    from ocmm_trackers._frames import (
        FrameAccount, FrameBuilder, GeometryProof, MarkerFrame, judge_geometry,
    )  # fmt: skip
    from ocmm_trackers._igtl import IDENTITY, IgtlDecoder, checksum, decode, fraction_of
    from ocmm_trackers._link import TrackerLink
    from ocmm_trackers._messages import (
        Decoder, DeviceStatus, MarkerPlace, Message, MessageAccount, Pose, SensorValues,
    )  # fmt: skip
    from ocmm_trackers._motion_capture import NatNetDecoder, QtmDecoder
    from ocmm_trackers._ndi import NdiDecoder, checksum_ndi, command_of
    from ocmm_trackers._pose_file import PoseFile, ToolPivot, pivot_of_files, read_poses
    from ocmm_trackers._process import tracker_command
    from ocmm_trackers._source import PROTOCOLS, TrackerConfig, TrackerSource, tracker_description
    from ocmm_trackers._specs import IGTL, NATNET, NDI, QTM
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "IDENTITY", "IGTL", "NATNET", "NDI", "PROTOCOLS", "QTM", "Decoder", "DeviceStatus",
    "FrameAccount", "FrameBuilder", "GeometryProof", "IgtlDecoder", "MarkerFrame", "MarkerPlace",
    "Message", "MessageAccount", "NatNetDecoder", "NdiDecoder", "Pose", "PoseFile", "QtmDecoder",
    "SensorValues", "ToolPivot", "TrackerConfig", "TrackerLink", "TrackerSource", "checksum",
    "checksum_ndi", "command_of", "decode", "fraction_of", "judge_geometry", "pivot_of_files",
    "read_poses", "tracker_command", "tracker_config", "tracker_description",
]  # fmt: skip
