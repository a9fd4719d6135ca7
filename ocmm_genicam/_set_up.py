"""Set-up of a camera by documents: `resources/genicam`, one for all cameras and one for each make.

A camera that processes its image (gamma, automatic exposure, a mirrored or binned image) sends
spots whose middle is elsewhere: such settings are written, read back, and refused if they stay.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from functools import cache

import msgspec

from ocmm_core.camera import USUAL_SLOTS, Window
from ocmm_core.documents import Document, files_of_folder, load_document, resource
from ocmm_core.errors import AcquisitionError
from ocmm_genicam._client import FORMATS, Camera, Image, PixelFormat

_TRUTHS = {"false": "0", "true": "1"}
_ALIKE, _RATE = 1e-6, 0.01


class _Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    pass


class FeatureSetting(_Part, frozen=True, kw_only=True):
    """Value that a feature must have, if the camera has it."""

    feature: str
    value: str
    """As the camera writes it; numbers and switches are compared as such."""


class Need(_Part, frozen=True, kw_only=True):
    """Features of which a camera should have one."""

    features: tuple[str, ...]
    lost: str
    """Sentence about a camera that has none of them; translated by its catalogue."""


class PtpNames(_Part, frozen=True, kw_only=True):
    """Features of one family of PTP names."""

    enable: str
    on: str = "true"
    status: str
    offset: str
    grandmaster: str
    latch: str = ""


class MakeDocument(Document, frozen=True, kw_only=True):
    """Document of a make."""

    make: str
    """Part of the maker's name, in any case; empty: all cameras."""
    exposure: tuple[str, ...] = ()
    gain: tuple[str, ...] = ()
    rate: tuple[str, ...] = ()
    rate_enable: tuple[str, ...] = ()
    resulting_rate: tuple[str, ...] = ()
    settings: tuple[FeatureSetting, ...] = ()
    needs: tuple[Need, ...] = ()
    ptp: tuple[PtpNames, ...] = ()
    """`exposure` to `ptp`: names in the order in which they are tried; those of the make first."""


@dataclass(frozen=True, slots=True)
class Expected:
    """A camera as the rig knows it."""

    name: str
    width: int
    height: int
    period_ns: int
    button_line: int = -1
    """Input line that the button of the probe is wired to; negative: none."""
    n_slots: int = USUAL_SLOTS
    window: Window | None = None
    """Part of the sensor that is needed; None: all of it."""
    black: str = ""
    """Path of its black image, used if it exists."""


@dataclass(frozen=True, slots=True)
class SetUp:
    """A camera as it was set up."""

    pixels: PixelFormat
    window: Window
    """Part of the sensor that is sent."""

    @property
    def size(self) -> int:
        """Return the bytes of an image."""
        return self.pixels.bytes_of(self.window.width, self.window.height)

    def is_of(self, image: Image) -> bool:
        """Return whether an image has the format and the part of the sensor that were set."""
        window = self.window
        return (image.pixel_format, image.width, image.height, image.left, image.top) == (
            self.pixels.code, window.width, window.height, window.left, window.top,
        )  # fmt: skip


@cache
def _documents() -> tuple[MakeDocument, ...]:
    return tuple(
        load_document(path, MakeDocument, "ocmm.genicam/1")
        for path in files_of_folder(resource("genicam"), ".toml")
    )


def documents_for(model: str) -> tuple[MakeDocument, ...]:
    """Return the documents of a camera by maker and model, that of its make before the common."""
    fitting = [one for one in _documents() if one.make.lower() in model.lower()]
    return tuple(sorted(fitting, key=lambda one: not one.make))


def first_of(camera: Camera, names: tuple[str, ...]) -> str:
    """Return the first of some features that a camera has; empty without one."""
    return next((one for one in names if camera.has(one)), "")


def sensor_size(camera: Camera) -> tuple[int, int]:
    """Return the width and height of a whole image, px."""
    width, height = (
        first_of(camera, (f"{side}Max", f"Sensor{side}")) or side for side in ("Width", "Height")
    )
    return camera.integer(width), camera.integer(height)


def lost_by(camera: Camera) -> tuple[str, ...]:
    """Return what is lost by the features that a camera lacks, one sentence each."""
    return tuple(
        need.lost
        for one in documents_for(camera.model)
        for need in one.needs
        if not first_of(camera, need.features)
    )


def ptp_names(camera: Camera) -> PtpNames | None:
    """Return the PTP names of a camera; None without PTP."""
    families = (family for one in documents_for(camera.model) for family in one.ptp)
    return next((one for one in families if camera.has(one.enable)), None)


def settings_of(camera: Camera) -> tuple[float, float]:
    """Return exposure time, microseconds, and gain of a camera; NaN without one."""
    return _real(camera, "exposure"), _real(camera, "gain")


def _real(camera: Camera, field: str) -> float:
    name = _named(camera, field)
    # Of some cameras a whole number, of others a real one.
    return float(camera.text(name)) if name else math.nan


def set_exposure(camera: Camera, expected: Expected, exposure_us: float) -> None:
    """Set the exposure time; AcquisitionError if it is out of range, or the rate would change."""
    _set_named(camera, "exposure", exposure_us, f"an exposure time of {exposure_us:.1f} us")
    _set_rate(camera, 1e9 / expected.period_ns)


def has_decibels(camera: Camera) -> bool:
    """Return whether the gain is in decibels, as the convention states for this name."""
    return _named(camera, "gain") == "Gain"


def set_gain(camera: Camera, value: float) -> None:
    """Set the gain, in the unit of its maker; AcquisitionError if it is out of range."""
    _set_named(camera, "gain", value, f"a gain of {value:g}")


def store(camera: Camera) -> None:
    """Store all settings as the first user set, loaded at power-up; AcquisitionError."""
    default = first_of(camera, ("UserSetDefault", "UserSetDefaultSelector"))
    if not camera.has("UserSetSave") or not default:
        raise AcquisitionError(
            "genicam.user_set",
            f"Camera {camera.serial} cannot store its settings.",
            "Set exposure and gain again after each power-up.",
        )
    camera.set_text("UserSetSelector", "UserSet1")
    camera.execute("UserSetSave")
    camera.set_text(default, "UserSet1")


def _set_named(camera: Camera, field: str, value: float, words: str) -> None:
    name, found = _named(camera, field), math.nan
    if name:
        with contextlib.suppress(AcquisitionError):
            # A whole number in some cameras.
            if name.endswith("Raw"):
                camera.set_integer(name, round(value))
            else:
                camera.set_number(name, value)
        found = float(camera.text(name))
    if not math.isclose(found, value, rel_tol=0.05, abs_tol=1.0):
        raise AcquisitionError(
            "genicam.out_of_range",
            f"Camera {camera.serial} does not take {words}; it keeps {found:g}.",
            "Give another value, dim or brighten the LEDs, or change the stop of the lens.",
        )


def set_up(camera: Camera, expected: Expected) -> SetUp:
    """Set format, region, rate and what its documents demand, and read it back.

    AcquisitionError for a camera that cannot be set so.
    """
    serial = camera.serial
    for document in documents_for(camera.model):
        for setting in document.settings:
            _apply(camera, setting)
    offered = camera.entries("PixelFormat")
    pixels = next((one for one in FORMATS if one.name in offered), None)
    if pixels is None:
        raise AcquisitionError(
            "genicam.format",
            f"Camera {serial} has no pixel format that OCMM reads; it has {', '.join(offered)}.",
            f"Use a monochrome camera with one of {', '.join(one.name for one in FORMATS)}.",
        )
    camera.set_text("PixelFormat", pixels.name)
    for offset in ("OffsetX", "OffsetY"):
        if camera.has(offset):
            camera.set_integer(offset, 0)
    size = sensor_size(camera)
    if size != (expected.width, expected.height):
        raise AcquisitionError(
            "genicam.size",
            f"Camera {serial} has {size[0]} x {size[1]} px, but camera '{expected.name}' of the "
            f"rig has {expected.width} x {expected.height} px.",
            "Use the camera that the rig was made for, without binning, or correct the rig.",
        )
    window = _set_window(camera, expected)
    _set_rate(camera, 1e9 / expected.period_ns)
    return SetUp(pixels, window)


def _set_window(camera: Camera, expected: Expected) -> Window:
    """Set the least part of the sensor that has the one that is needed; each image states it."""
    needed = expected.window or Window(0, 0, expected.width, expected.height)
    wanted = []
    for axis, side, first, size, full in (
        ("X", "Width", needed.left, needed.width, expected.width),
        ("Y", "Height", needed.top, needed.height, expected.height),
    ):
        begin = count = 0
        if camera.has(f"Offset{axis}"):
            step, (least, grid) = camera.steps(f"Offset{axis}")[1], camera.steps(side)
            # Packed pixels end with a byte.
            grid = math.lcm(grid, 4)
            begin = first // step * step
            count = -(-max(first + size - begin, least) // grid) * grid
        if not 0 < begin + count <= full:
            begin, count = 0, full
        camera.set_integer(side, count)
        if camera.has(f"Offset{axis}"):
            camera.set_integer(f"Offset{axis}", begin)
        wanted.append((begin, count))
    (left, width), (top, height) = wanted
    return Window(left, top, width, height)


def _set_rate(camera: Camera, rate: float) -> None:
    """Set the rate of a camera that exposes freely, and check that its link carries it."""
    resulting = _named(camera, "resulting_rate")
    if not (camera.has("TriggerMode") and camera.text("TriggerMode") == "On"):
        # Without any, the camera names the one that it lacks.
        enable, name = (_named(camera, one) for one in ("rate_enable", "rate"))
        if enable:
            camera.set_text(enable, "true")
        name = name or "AcquisitionFrameRate"
        camera.set_number(name, rate)
        real = camera.number(name)
        if not abs(real - rate) <= _RATE * rate:
            raise AcquisitionError(
                "genicam.rate",
                f"Camera {camera.serial} takes {real:.4g} frames a second, but the rig states "
                f"{rate:.4g}.",
                f"Set a shorter exposure, or {real:.4g} as 'frame_rate_hz' of the rig.",
            )
    if resulting and (real := camera.number(resulting)) < (1.0 - _RATE) * rate:
        raise AcquisitionError(
            "genicam.link",
            f"Camera {camera.serial} can send {real:.4g} frames a second only, but the rig states "
            f"{rate:.4g}: its exposure, readout or link takes longer.",
            f"Set a shorter exposure, a faster link, or {math.floor(real)} as 'frame_rate_hz' of "
            "the rig.",
        )


def _named(camera: Camera, field: str) -> str:
    found = (first_of(camera, getattr(one, field)) for one in documents_for(camera.model))
    return next((one for one in found if one), "")


def _apply(camera: Camera, setting: FeatureSetting) -> None:
    feature, needed = setting.feature, setting.value
    if not camera.has(feature) or _are_alike(camera.text(feature), needed):
        return
    # The value decides: a camera may lock what it cannot change.
    with contextlib.suppress(AcquisitionError):
        camera.set_text(feature, needed)
    found = camera.text(feature)
    if not _are_alike(found, needed):
        raise AcquisitionError(
            "genicam.setting",
            f"Camera {camera.serial} keeps {feature} at {found}, but OCMM needs {needed}: its "
            "spots would be elsewhere than the light.",
            "Set it with the program of the maker, save it as the user set that is loaded at "
            "power-up, then open the job again.",
        )


def _are_alike(found: str, value: str) -> bool:
    try:
        first, second = (float(_TRUTHS.get(one.lower(), one)) for one in (found, value))
    except ValueError:
        return found == value
    return abs(first - second) <= _ALIKE
