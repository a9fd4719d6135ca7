"""Frames and datagrams, sockets, the service channel, and the pysoem wrapper.

In: bytes of an interface.
Out: matched answers, EEPROM words, and the devices on the wire.

Start with `_datagrams` (EtherCAT bytes), `_sockets` and `_port` (raw sockets, a tap for Wireshark);
then `_interface` (admissible interfaces, other masters), `_port` (clocks), `_master` (the only file
that imports pysoem) with `_object_calls`, `_service` (one own frame per cycle), `_tally` (answers
received), `_scan`; `_virtual_link` (cables without hardware).

It must not import objects or alarms, nor decide on faults.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.wire._datagrams import (
        Command, Datagram, decode_frame, encode_frame, frame_index, has_passed,
    )  # fmt: skip
    from ocmm_core.fieldbus.wire._interface import (
        MasterWatch, check_interface, is_virtual_cable, is_virtual_interface, require_pysoem,
    )  # fmt: skip
    from ocmm_core.fieldbus.wire._master import OP, PREOP, SAFEOP, STATE_NAMES, Master, al_text
    from ocmm_core.fieldbus.wire._object_calls import check_mapping
    from ocmm_core.fieldbus.wire._port import HostTime, Passage, Port
    from ocmm_core.fieldbus.wire._scan import (
        Exchange, RawLine, ScannedDevice, decode_scan, encode_scan, read_words, scan_devices,
        write_word,
    )  # fmt: skip
    from ocmm_core.fieldbus.wire._service import EepromRead, Job, ServiceChannel
    from ocmm_core.fieldbus.wire._sockets import (
        LinkWatch, Tap, TappedFrame, pcapng_end, pcapng_frame, pcapng_head,
    )  # fmt: skip
    from ocmm_core.fieldbus.wire._tally import OWN_TOKEN
    from ocmm_core.fieldbus.wire._virtual_link import (
        CAMERA_INTERFACE, HOST_INTERFACE, make_link, namespace_command, remove_link, set_link, tool,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CAMERA_INTERFACE", "HOST_INTERFACE", "OP", "OWN_TOKEN", "PREOP", "SAFEOP", "STATE_NAMES",
    "Command", "Datagram", "EepromRead", "Exchange", "HostTime", "Job", "LinkWatch", "Master",
    "MasterWatch", "Passage", "Port", "RawLine", "ScannedDevice", "ServiceChannel", "Tap",
    "TappedFrame", "al_text", "check_interface", "check_mapping", "decode_frame", "decode_scan",
    "encode_frame", "encode_scan", "frame_index", "has_passed", "is_virtual_cable",
    "is_virtual_interface", "make_link", "namespace_command", "pcapng_end", "pcapng_frame",
    "pcapng_head", "read_words", "remove_link", "require_pysoem", "scan_devices", "set_link",
    "tool", "write_word",
]  # fmt: skip
