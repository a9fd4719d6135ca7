"""Acyclic camera objects: mailboxes, transfers, images, temperatures.

In: requests for objects.
Out: their values, images and emergencies, without delaying the cycle.

Start with `_requests` (one JSON line each) and `_objects` (acyclic service); then `_mailbox_line`
and `_sdo` (transfers). Host side: `_camera_client`, `_maintenance`.

It must not import bring-up or supervision; `cycle` provides the channel.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.objects._camera_client import (
        BlackImageState, ObjectAccess, Progress, blink, clear_black_image, clear_error_history,
        encoder_for, load_black_image, measure_black_image, read_black_image, read_error_history,
        read_intrinsics, store_black_image, take_snapshot, write_intrinsics,
    )  # fmt: skip
    from ocmm_core.fieldbus.objects._mailbox_line import (
        SYNC_MANAGERS, SYNC_MANAGER_BYTES, Emergency, MailboxAreas,
    )  # fmt: skip
    from ocmm_core.fieldbus.objects._maintenance import (
        FIRMWARE_NAME, FoeWrite, check_sum, find_camera, update_firmware, write_alias,
    )  # fmt: skip
    from ocmm_core.fieldbus.objects._objects import ObjectService, RequestPort, Thermometer
    from ocmm_core.fieldbus.objects._requests import (
        MAX_EEPROM_WORDS, MAX_LINE_BYTES, MAX_VALUE_BYTES, CancelRequest, EepromRequest,
        ObjectReply, ObjectRequest, Request, decode_reply, decode_request, encode_line,
    )  # fmt: skip
    from ocmm_core.fieldbus.objects._sdo import SERVICE_SDO_RESPONSE, coe_content
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FIRMWARE_NAME", "MAX_EEPROM_WORDS", "MAX_LINE_BYTES", "MAX_VALUE_BYTES",
    "SERVICE_SDO_RESPONSE", "SYNC_MANAGERS", "SYNC_MANAGER_BYTES", "BlackImageState",
    "CancelRequest", "EepromRequest", "Emergency", "FoeWrite", "MailboxAreas", "ObjectAccess",
    "ObjectReply", "ObjectRequest", "ObjectService", "Progress", "Request", "RequestPort",
    "Thermometer", "blink", "check_sum", "clear_black_image", "clear_error_history", "coe_content",
    "decode_reply", "decode_request", "encode_line", "encoder_for", "find_camera",
    "load_black_image", "measure_black_image", "read_black_image", "read_error_history",
    "read_intrinsics", "store_black_image", "take_snapshot", "update_firmware", "write_alias",
    "write_intrinsics",
]  # fmt: skip
