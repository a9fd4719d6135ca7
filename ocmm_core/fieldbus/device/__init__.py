"""Device model of the smart camera: objects, identity and ESI file.

In: only the tables here.
Out: one model for master, software camera, ESI file and page.

Start with `_camera_objects` (object dictionary), `_object_entries` and `_profile_objects` (also
messages of the diagnosis history); then `_camera_slave` (process data and configuration),
`_input_layout` (header by revision), `_identity` (device to camera assignment), and `_firmware`
(blocks in a camera).

It must not import sockets, cycles or the virtual rig.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.device._camera_objects import (
        DEVICE_TYPE, ERROR_REGISTER, ERROR_TEXTS, HISTORY, HISTORY_FIRST, HISTORY_MESSAGES,
        IDENTITY, IDENTITY_SERIAL, INPUT_SYNC, OUTPUT_SYNC, SM_ASSIGNMENT, SYNC_CYCLE, SYNC_ERROR,
        SYNC_EXCEEDED, SYNC_MISSED, SYNC_MODE, TIMESTAMP, ErrorCode, ErrorRegister,
        configuration_values, object_dictionary,
    )  # fmt: skip
    from ocmm_core.fieldbus.device._camera_slave import (
        COUNTER_MODULUS, DEFAULT_FRAME_PERIOD_NS, DEVICE_NAME, FRAMES_PER_CYCLE, FRAME_DTYPE,
        FRAME_PDOS, HEADER_PDO, HEADER_STRUCT, INPUT_DTYPE, INPUT_PDOS, INPUT_START, MAILBOX_BYTES,
        MAILBOX_IN_START, MAILBOX_OUT_START, N_SLOTS, OUTPUT_DTYPE, OUTPUT_PDO, OUTPUT_START,
        OUTPUT_STRUCT, PRODUCT_CODE, REVISION, SM_INPUTS, SM_MAILBOX_IN, SM_MAILBOX_OUT, SM_OUTPUTS,
        SUBPIXELS, SYNC0_NS, SYNC1_NS, SYNC_MANAGERS, VENDOR_ID, VENDOR_NAME, CameraConfig,
        CameraMode, CameraStatus, Control, DataType, Pdo, Window, decode_spots, encode_frames,
        frames_of, require_raw,
    )  # fmt: skip
    from ocmm_core.fieldbus.device._firmware import BLOB_BYTES, Firmware, Intrinsics
    from ocmm_core.fieldbus.device._identity import (
        CameraIdentity, FoundDevice, assign, check_sensor,
    )  # fmt: skip
    from ocmm_core.fieldbus.device._input_layout import (
        DATA_CRC, DATA_CRC_AT, INPUT_LAYOUTS, NEWEST_LAYOUT, NO_MARK, Header, InputLayout,
        data_mark,
    )  # fmt: skip
    from ocmm_core.fieldbus.device._object_entries import Access, DictionaryObject, ObjectEntry
    from ocmm_core.fieldbus.device._profile_objects import (
        BLACK_IMAGE, CALIBRATION, CHUNK_BYTES, CONFIGURATION, COUNTERS, DATA_BYTES, IDENTIFY,
        INFORMATION, MAX_BLACK_FRAMES, MESSAGE_BYTES, NOTE_BYTES, SNAPSHOT, VERSIONS, WINDOWS,
        BlackCommand, BlackImage, DiagnosisMessage, SnapshotCommand, Work,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BLACK_IMAGE", "BLOB_BYTES", "CALIBRATION", "CHUNK_BYTES", "CONFIGURATION", "COUNTERS",
    "COUNTER_MODULUS", "DATA_BYTES", "DATA_CRC", "DATA_CRC_AT", "DEFAULT_FRAME_PERIOD_NS",
    "DEVICE_NAME", "DEVICE_TYPE", "ERROR_REGISTER", "ERROR_TEXTS", "FRAMES_PER_CYCLE",
    "FRAME_DTYPE", "FRAME_PDOS", "HEADER_PDO", "HEADER_STRUCT", "HISTORY", "HISTORY_FIRST",
    "HISTORY_MESSAGES", "IDENTIFY", "IDENTITY", "IDENTITY_SERIAL", "INFORMATION", "INPUT_DTYPE",
    "INPUT_LAYOUTS", "INPUT_PDOS", "INPUT_START", "INPUT_SYNC", "MAILBOX_BYTES", "MAILBOX_IN_START",
    "MAILBOX_OUT_START", "MAX_BLACK_FRAMES", "MESSAGE_BYTES", "NEWEST_LAYOUT", "NOTE_BYTES",
    "NO_MARK", "N_SLOTS", "OUTPUT_DTYPE", "OUTPUT_PDO", "OUTPUT_START", "OUTPUT_STRUCT",
    "OUTPUT_SYNC", "PRODUCT_CODE", "REVISION", "SM_ASSIGNMENT", "SM_INPUTS", "SM_MAILBOX_IN",
    "SM_MAILBOX_OUT", "SM_OUTPUTS", "SNAPSHOT", "SUBPIXELS", "SYNC0_NS", "SYNC1_NS", "SYNC_CYCLE",
    "SYNC_ERROR", "SYNC_EXCEEDED", "SYNC_MANAGERS", "SYNC_MISSED", "SYNC_MODE", "TIMESTAMP",
    "VENDOR_ID", "VENDOR_NAME", "VERSIONS", "WINDOWS", "Access", "BlackCommand", "BlackImage",
    "CameraConfig", "CameraIdentity", "CameraMode", "CameraStatus", "Control", "DataType",
    "DiagnosisMessage", "DictionaryObject", "ErrorCode", "ErrorRegister", "Firmware", "FoundDevice",
    "Header", "InputLayout", "Intrinsics", "ObjectEntry", "Pdo", "SnapshotCommand", "Window",
    "Work", "assign", "check_sensor", "configuration_values", "data_mark", "decode_spots",
    "encode_frames", "frames_of", "object_dictionary", "require_raw",
]  # fmt: skip
