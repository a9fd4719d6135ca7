"""Cameras that are not ours: described by a file, brought to operation and read like ours.

In: a document `ocmm.device/1` and the bytes of such a camera. Out: the same inputs that our own
cameras send, so that everything behind them is the same; and what the camera cannot prove, in
words.

Read `_device_file` (the document), `_device_check` with `_device_places` (what it must not say),
`_proof` (what the camera cannot prove, and what that costs), `_process_image` (bytes by the
document), `_lens` (from corrected millimetres back to pixels), `_translator` (its inputs as those
of our cameras).
It must not know sockets or cycles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.fieldbus.described._device_check import load_device
    from ocmm_core.fieldbus.described._device_file import (
        Clock,
        DeviceDescription,
        Entry,
        ProcessObject,
        Role,
        Sends,
        StartUp,
    )
    from ocmm_core.fieldbus.described._lens import corrected_from_pixels, pixels_from_corrected
    from ocmm_core.fieldbus.described._process_image import ProcessImage
    from ocmm_core.fieldbus.described._proof import (
        UNPROVEN_CAMERAS,
        AllowedBy,
        Doubt,
        age_doubts,
        doubt_line,
        doubt_sentences,
        doubts_by_name,
        doubts_of,
        refuse_coarse,
        refuse_unproven,
        resting_doubt_mm,
    )
    from ocmm_core.fieldbus.described._translator import InputTranslator, Timing
else:
    __getattr__ = door(
        __name__,
        _device_check="load_device",
        _device_file="Clock DeviceDescription Entry ProcessObject Role Sends StartUp",
        _lens="corrected_from_pixels pixels_from_corrected",
        _process_image="ProcessImage",
        _proof=(
            "AllowedBy Doubt UNPROVEN_CAMERAS age_doubts doubt_line doubt_sentences "
            "doubts_by_name doubts_of refuse_coarse refuse_unproven resting_doubt_mm"
        ),
        _translator="InputTranslator Timing",
    )

__all__ = [
    "UNPROVEN_CAMERAS",
    "AllowedBy",
    "Clock",
    "DeviceDescription",
    "Doubt",
    "Entry",
    "InputTranslator",
    "ProcessImage",
    "ProcessObject",
    "Role",
    "Sends",
    "StartUp",
    "Timing",
    "age_doubts",
    "corrected_from_pixels",
    "doubt_line",
    "doubt_sentences",
    "doubts_by_name",
    "doubts_of",
    "load_device",
    "pixels_from_corrected",
    "refuse_coarse",
    "refuse_unproven",
    "resting_doubt_mm",
]
