"""GigE Vision cameras by the library Aravis 0.8, called with ctypes."""

from __future__ import annotations

import contextlib
import ctypes as c
from functools import cache
from ipaddress import IPv4Address
from typing import Any

import numpy as np

from ocmm_core.errors import AcquisitionError
from ocmm_genicam._client import Image, is_absent, is_controlled, is_refused

_LIBRARY = "libaravis-0.8.so.0"
BUFFERS = 24
_SOCKET_BYTES = 4 << 20
FRAME_KEPT_US = 100_000
"""Time for the packets of a frame; an incomplete one holds back those behind it."""
_NO_PACKET_SOCKET = 1
_ADDRESS = 0x24
"""Register of GigE Vision: the IPv4 address in use."""
_P, _S, _U64, _I64 = c.c_void_p, c.c_char_p, c.c_uint64, c.c_int64
_ERROR = c.POINTER(_P)
_CALLS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "arv_update_device_list": (None, ()),
    "arv_get_n_devices": (c.c_uint, ()),
    "arv_get_device_id": (_S, (c.c_uint,)),
    "arv_get_device_serial_nbr": (_S, (c.c_uint,)),
    "arv_get_device_vendor": (_S, (c.c_uint,)),
    "arv_get_device_model": (_S, (c.c_uint,)),
    "arv_camera_new": (_P, (_S, _ERROR)),
    "arv_camera_get_device": (_P, (_P,)),
    "arv_camera_get_payload": (c.c_uint, (_P, _ERROR)),
    "arv_camera_is_gv_device": (c.c_int, (_P,)),
    "arv_camera_gv_set_stream_options": (None, (_P, c.c_int)),
    "arv_camera_create_stream": (_P, (_P, _P, _P, _ERROR)),
    "arv_camera_start_acquisition": (None, (_P, _ERROR)),
    "arv_camera_stop_acquisition": (None, (_P, _ERROR)),
    "arv_gv_device_is_controller": (c.c_int, (_P,)),
    "arv_gv_device_get_timestamp_tick_frequency": (_U64, (_P, _ERROR)),
    "arv_device_is_feature_available": (c.c_int, (_P, _S, _ERROR)),
    "arv_device_get_feature": (_P, (_P, _S)),
    "arv_gc_feature_node_get_value_as_string": (_S, (_P, _ERROR)),
    "arv_gc_feature_node_set_value_from_string": (None, (_P, _S, _ERROR)),
    "arv_device_get_integer_feature_value": (_I64, (_P, _S, _ERROR)),
    "arv_device_set_integer_feature_value": (None, (_P, _S, _I64, _ERROR)),
    "arv_device_get_float_feature_value": (c.c_double, (_P, _S, _ERROR)),
    "arv_device_set_float_feature_value": (None, (_P, _S, c.c_double, _ERROR)),
    "arv_device_get_integer_feature_increment": (_I64, (_P, _S, _ERROR)),
    "arv_device_get_integer_feature_bounds": (
        None, (_P, _S, c.POINTER(_I64), c.POINTER(_I64), _ERROR),
    ),
    "arv_device_read_register": (c.c_int, (_P, _U64, c.POINTER(c.c_uint32), _ERROR)),
    "arv_device_execute_command": (None, (_P, _S, _ERROR)),
    "arv_device_dup_available_enumeration_feature_values_as_strings": (
        _P, (_P, _S, c.POINTER(c.c_uint), _ERROR),
    ),
    "arv_buffer_new": (_P, (c.c_size_t, _P)),
    "arv_stream_push_buffer": (None, (_P, _P)),
    "arv_stream_timeout_pop_buffer": (_P, (_P, _U64)),
    "arv_buffer_get_status": (c.c_int, (_P,)),
    "arv_buffer_get_data": (_P, (_P, c.POINTER(c.c_size_t))),
    "arv_buffer_get_frame_id": (_U64, (_P,)),
    "arv_buffer_get_timestamp": (_U64, (_P,)),
    "arv_buffer_get_image_width": (c.c_int, (_P,)),
    "arv_buffer_get_image_height": (c.c_int, (_P,)),
    "arv_buffer_get_image_x": (c.c_int, (_P,)),
    "arv_buffer_get_image_y": (c.c_int, (_P,)),
    "arv_buffer_get_image_pixel_format": (c.c_uint32, (_P,)),
    "g_object_unref": (None, (_P,)),
    "g_error_free": (None, (_P,)),
    "g_free": (None, (_P,)),
}  # fmt: skip
"""Result and arguments of each function; a missing entry would cut pointers to 32 bits."""


class _Error(c.Structure):
    _fields_ = (("domain", c.c_uint32), ("code", c.c_int), ("message", c.c_char_p))


@cache
def _library() -> c.CDLL:
    try:
        library = c.CDLL(_LIBRARY)
    except OSError as error:
        raise AcquisitionError(
            "genicam.library",
            f"The library Aravis, which reads GenICam cameras, cannot be loaded ({error}).",
            "Install it: sudo apt-get install libaravis-0.8-0",
        ) from error
    for name, (result, arguments) in _CALLS.items():
        # GLib comes with Aravis, and its symbols with the handle.
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def _call(name: str, *arguments: object, to: str) -> Any:
    """Call a function whose last argument is an error; raise it as AcquisitionError."""
    error = _P()
    result = getattr(_library(), name)(*arguments, c.byref(error))
    if error.value is not None:
        message = c.cast(error, c.POINTER(_Error)).contents.message or b""
        _library().g_error_free(error)
        raise is_refused(to, message.decode("utf-8", "replace"))
    return result


class AravisCameras:
    """The cameras that Aravis finds; loads the library, AcquisitionError if it is missing.

    `patience_us`: time for the packets of a frame; a fifth of it until one is requested again.
    """

    def __init__(self, patience_us: int = FRAME_KEPT_US) -> None:
        self._library = _library()
        self._patience_us = patience_us
        self._found: dict[str, tuple[bytes, str]] = {}
        """Identifier, and maker and model, by serial number."""

    def found(self) -> dict[str, str]:
        """Return maker and model of each camera in the network, by serial number."""
        library = self._library
        library.arv_update_device_list()
        self._found.clear()
        for index in range(library.arv_get_n_devices()):
            serial, *names = (
                (read(index) or b"").decode("utf-8", "replace")
                for read in (
                    library.arv_get_device_serial_nbr, library.arv_get_device_vendor,
                    library.arv_get_device_model,
                )
            )  # fmt: skip
            self._found[serial] = (library.arv_get_device_id(index), " ".join(names))
        return {serial: model for serial, (_, model) in self._found.items()}

    def open(self, serial: str) -> AravisCamera:
        """Take control of a camera; see `Cameras`."""
        if serial not in self._found:
            # Takes a second.
            self.found()
        if serial not in self._found:
            raise is_absent(serial, {one: model for one, (_, model) in self._found.items()})
        identifier, model = self._found[serial]
        return AravisCamera(identifier, serial, model, self._patience_us)


class AravisCamera:
    """One camera, see `Camera`."""

    def __init__(self, identifier: bytes, serial: str, model: str, patience_us: int) -> None:
        self._library, self._patience_us = _library(), patience_us
        self.serial, self.model = serial, model
        self._camera: int | None = _call("arv_camera_new", identifier, to=serial)
        self._stream: int | None = None
        self._taken: int | None = None
        self._device = self._library.arv_camera_get_device(self._camera)
        if not self._library.arv_camera_is_gv_device(self._camera):
            self.close()
            raise AcquisitionError(
                "genicam.transport",
                f"Camera {serial} is no GigE Vision camera: it has no clock in common with others.",
                "Use GigE Vision cameras with PTP (IEEE 1588).",
            )
        if not self._library.arv_gv_device_is_controller(self._device):
            self.close()
            raise is_controlled(serial)
        self._library.arv_camera_gv_set_stream_options(self._camera, _NO_PACKET_SOCKET)

    def _feature(self, name: str, feature: str, *value: object) -> Any:
        return _call(f"arv_device_{name}", self._device, feature.encode(), *value, to=self.serial)

    def _node(self, name: str, feature: str, *value: object) -> Any:
        node = self._library.arv_device_get_feature(self._device, feature.encode())
        return _call(f"arv_gc_feature_node_{name}", node, *value, to=self.serial)

    def has(self, feature: str) -> bool:
        return bool(self._feature("is_feature_available", feature))

    def text(self, feature: str) -> str:
        value: bytes | None = self._node("get_value_as_string", feature)
        return (value or b"").decode("utf-8", "replace")

    def number(self, feature: str) -> float:
        return float(self._feature("get_float_feature_value", feature))

    def integer(self, feature: str) -> int:
        return int(self._feature("get_integer_feature_value", feature))

    def set_text(self, feature: str, value: str) -> None:
        self._node("set_value_from_string", feature, value.encode())

    def set_number(self, feature: str, value: float) -> None:
        self._feature("set_float_feature_value", feature, value)

    def set_integer(self, feature: str, value: int) -> None:
        self._feature("set_integer_feature_value", feature, value)

    def steps(self, feature: str) -> tuple[int, int]:
        least, most = _I64(), _I64()
        self._feature("get_integer_feature_bounds", feature, c.byref(least), c.byref(most))
        return least.value, max(self._feature("get_integer_feature_increment", feature), 1)

    def address(self) -> str:
        value = c.c_uint32()
        _call("arv_device_read_register", self._device, _ADDRESS, c.byref(value), to=self.serial)
        return str(IPv4Address(value.value))

    def execute(self, feature: str) -> None:
        self._feature("execute_command", feature)

    def entries(self, feature: str) -> tuple[str, ...]:
        count = c.c_uint()
        values = self._feature(
            "dup_available_enumeration_feature_values_as_strings", feature, c.byref(count)
        )
        names = c.cast(values, c.POINTER(_S))
        found = tuple((names[i] or b"").decode() for i in range(count.value))
        self._library.g_free(values)
        return found

    def tick_frequency(self) -> int:
        """Return the ticks of the time stamps in a second."""
        name = "arv_gv_device_get_timestamp_tick_frequency"
        return int(_call(name, self._device, to=self.serial))

    def start(self) -> None:
        """Allocate buffers and start the acquisition."""
        size = _call("arv_camera_get_payload", self._camera, to=self.serial)
        self._stream = _call("arv_camera_create_stream", self._camera, None, None, to=self.serial)
        set_ = self._library.g_object_set
        set_.restype = None
        for name, value in (
            (b"socket-buffer", 0), (b"socket-buffer-size", _SOCKET_BYTES),
            (b"packet-timeout", self._patience_us // 5), (b"frame-retention", self._patience_us),
        ):  # fmt: skip
            set_(_P(self._stream), name, c.c_int(value), None)
        for _ in range(BUFFERS):
            buffer = self._library.arv_buffer_new(size, None)
            self._library.arv_stream_push_buffer(self._stream, buffer)
        _call("arv_camera_start_acquisition", self._camera, to=self.serial)

    def next_image(self, timeout_s: float) -> Image | None:
        """Return the next buffer, which replaces the one before, or None."""
        library = self._library
        if self._taken is not None:
            library.arv_stream_push_buffer(self._stream, self._taken)
        self._taken = buffer = library.arv_stream_timeout_pop_buffer(
            self._stream, round(timeout_s * 1e6)
        )
        if buffer is None:
            return None
        status = library.arv_buffer_get_status(buffer)
        if status:
            return Image(status, 0, 0, 0, 0, 0, np.zeros(0, np.uint8))
        size = c.c_size_t()
        place = library.arv_buffer_get_data(buffer, c.byref(size))
        return Image(
            status,
            library.arv_buffer_get_frame_id(buffer),
            library.arv_buffer_get_timestamp(buffer),
            library.arv_buffer_get_image_pixel_format(buffer),
            library.arv_buffer_get_image_width(buffer),
            library.arv_buffer_get_image_height(buffer),
            np.ctypeslib.as_array(c.cast(place, c.POINTER(c.c_uint8)), (size.value,)),
            library.arv_buffer_get_image_x(buffer),
            library.arv_buffer_get_image_y(buffer),
        )

    def close(self) -> None:
        """Stop and release the camera; idempotent."""
        library = self._library
        if self._stream is not None:
            # An unplugged camera stops by itself when its heartbeat ends.
            with contextlib.suppress(AcquisitionError):
                _call("arv_camera_stop_acquisition", self._camera, to=self.serial)
            if self._taken is not None:
                library.g_object_unref(self._taken)
            library.g_object_unref(self._stream)
        if self._camera is not None:
            library.g_object_unref(self._camera)
        self._camera = self._stream = self._taken = None
