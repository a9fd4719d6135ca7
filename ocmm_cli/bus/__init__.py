"""``ocmm bus`` and ``ocmm rig``: the cameras on the wire, real or software.

In: a network interface or a source, a camera, an object. Out: tables, pictures and files.

Read `_bus` (scan, objects, recording for Wireshark; software cameras on named interfaces) with
`_session` (bus in operation for a command, report of a running bus). `_camera` makes snapshots and
black images and has the options, `_decode` evaluates a tcpdump recording, `_maintenance` has the
commands for one camera. The protocol is in `fieldbus`, run by `acquisition.bus_process`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.bus._bus import bus_app, rig_app
    from ocmm_cli.bus._camera import follow_errand, write_bytes
    from ocmm_cli.bus._maintenance import camera_app
    from ocmm_cli.bus._session import bus_to_scan, command_of, open_bus, segment_for
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "bus_app", "bus_to_scan", "camera_app", "command_of", "follow_errand", "open_bus", "rig_app",
    "segment_for", "write_bytes",
]  # fmt: skip
