"""Cameras of other makers, described by a file and read like our own.

In: a document `ocmm.device/1` and the bytes of such a camera.
Out: inputs in the layout of our own cameras, and a list of what the camera cannot prove.

Start with `_device_file` (document), `_device_check` and `_device_places` (its checks), `_proof`
(missing proofs and their cost), `_esi_reader` and `_esi_conversion` (descriptions from ESI files),
`_process_image` (process data layout), `_translator` (conversion of inputs, corrected millimetres
back to pixels).

It must not import sockets or cycles.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.described._device_check import load_device
    from ocmm_core.fieldbus.described._device_file import (
        Clock, DeviceDescription, Entry, ProcessObject, Role, Sends, StartUp,
    )  # fmt: skip
    from ocmm_core.fieldbus.described._esi_conversion import (
        EsiStatements, describe_esi, missing_statements,
    )  # fmt: skip
    from ocmm_core.fieldbus.described._esi_reader import EsiDevice, choose_device
    from ocmm_core.fieldbus.described._process_image import ProcessImage
    from ocmm_core.fieldbus.described._proof import (
        REST_SPEED, UNPROVEN_CAMERAS, AllowedBy, Doubt, age_doubts, doubt_line, doubt_sentences,
        doubts_by_name, doubts_of, refuse_coarse, refuse_unproven, resting_doubt_mm,
    )  # fmt: skip
    from ocmm_core.fieldbus.described._translator import (
        InputTranslator, Timing, corrected_from_pixels, pixels_from_corrected,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "REST_SPEED", "UNPROVEN_CAMERAS", "AllowedBy", "Clock", "DeviceDescription", "Doubt", "Entry",
    "EsiDevice", "EsiStatements", "InputTranslator", "ProcessImage", "ProcessObject", "Role",
    "Sends", "StartUp", "Timing", "age_doubts", "choose_device", "corrected_from_pixels",
    "describe_esi", "doubt_line", "doubt_sentences", "doubts_by_name", "doubts_of", "load_device",
    "missing_statements", "pixels_from_corrected", "refuse_coarse", "refuse_unproven",
    "resting_doubt_mm",
]  # fmt: skip
