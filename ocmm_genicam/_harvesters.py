"""GenICam cameras by GenTL producers of their makers, with the package Harvesters.

They reach CoaXPress, Camera Link HS and USB3 Vision, and GigE Vision by drivers of the makers.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ocmm_core.documents import files_of_folder
from ocmm_core.errors import AcquisitionError
from ocmm_genicam._aravis import BUFFERS, FRAME_KEPT_US, AravisCameras
from ocmm_genicam._client import Cameras, Image, is_absent, is_controlled, is_refused

PATH_VARIABLE = "GENICAM_GENTL64_PATH"
"""Folders of the producers, set by the kits of the makers."""
T = TypeVar("T")
_LEAST_S = 1e-3
_PLACE = re.compile(r"\s*: \w+ thrown in .*|\s*\(Message from the source: .*")


def camera_library(gentl: bool, patience_us: int = FRAME_KEPT_US) -> Cameras:
    """Return the cameras of the GenTL producers, or those that Aravis finds; AcquisitionError."""
    return GenTLCameras() if gentl else AravisCameras(patience_us)


class GenTLCameras:
    """The cameras of all producers; AcquisitionError without package or producers."""

    def __init__(self) -> None:
        try:
            from harvesters import core
        except (ImportError, OSError) as error:
            raise AcquisitionError(
                "genicam.harvesters",
                f"The package Harvesters, which reads GenTL producers, cannot be loaded ({error}).",
                "Install it: pip install harvesters",
            ) from error
        folders = [one for one in os.environ.get(PATH_VARIABLE, "").split(os.pathsep) if one]
        files = [file for one in folders for file in files_of_folder(Path(one), ".cti")]
        if not files:
            raise AcquisitionError(
                "genicam.producer",
                f"No GenTL producer (.cti) was found: {PATH_VARIABLE} names "
                f"{', '.join(folders) or 'no folder'}.",
                f"Install the kit of the camera maker, and set {PATH_VARIABLE} to the folder of "
                "its .cti file.",
            )
        # It logs each refusal with a traceback, and raises it also.
        logging.getLogger("harvesters").setLevel(logging.CRITICAL)
        self._core, self._harvester = core, core.Harvester()
        for file in files:
            try:
                self._harvester.add_file(str(file), check_validity=True)
            except OSError as error:
                raise AcquisitionError(
                    "genicam.producer_broken",
                    f"The GenTL producer {file} cannot be loaded ({error}).",
                    f"Install the kit of its maker again, or remove its folder from "
                    f"{PATH_VARIABLE}.",
                ) from error
        self._found: dict[str, tuple[Any, str]] = {}
        """Device, and maker and model, by serial number."""

    def found(self) -> dict[str, str]:
        """Return maker and model of each camera by serial number; without one, by identifier."""
        with _translated("GenTL"):
            self._harvester.update()
            self._found = {
                _fact(one, "serial_number") or one.id_: (
                    one, f"{_fact(one, 'vendor') or ''} {_fact(one, 'model') or ''}"
                )
                for one in self._harvester.device_info_list
            }  # fmt: skip
        return {serial: model for serial, (_, model) in self._found.items()}

    def open(self, serial: str) -> GenTLCamera:
        """Take control of a camera; see `Cameras`."""
        # A second search would crash the cameras that are open.
        if not self._found:
            self.found()
        if serial not in self._found:
            raise is_absent(serial, {one: model for one, (_, model) in self._found.items()})
        device, model = self._found[serial]
        with _translated(serial):
            acquirer = self._harvester.create(device)
        return GenTLCamera(self._core, acquirer, serial, model)


class GenTLCamera:
    """One camera, see `Camera`."""

    def __init__(self, core: Any, acquirer: Any, serial: str, model: str) -> None:
        self.serial, self.model = serial, model
        self._acquirer, self._nodes = acquirer, acquirer.remote_device.node_map
        self._taken: Any = None
        self._incomplete: list[None] = []
        emit = {"emit": lambda _self, _of: self._incomplete.append(None)}
        counted = type("Counted", (core.Callback,), emit)
        acquirer.add_callback(acquirer.Events.INCOMPLETE_BUFFER, counted())

    def _ask(self, feature: str, read: Callable[[Any], T]) -> T:
        """Return what a feature answers; AcquisitionError if it is missing or refuses."""
        with _translated(self.serial):
            if (node := getattr(self._nodes, feature, None)) is None:
                raise AttributeError(f"no feature {feature}")
            return read(node)

    def has(self, feature: str) -> bool:
        from genicam import genapi

        node = getattr(self._nodes, feature, None)
        return node is not None and bool(genapi.is_available(node))

    def text(self, feature: str) -> str:
        return self._ask(feature, lambda node: str(node.to_string()))

    def number(self, feature: str) -> float:
        return self._ask(feature, lambda node: float(node.value))

    def integer(self, feature: str) -> int:
        return self._ask(feature, lambda node: int(node.value))

    def set_text(self, feature: str, value: str) -> None:
        self._ask(feature, lambda node: node.from_string(value))

    def set_number(self, feature: str, value: float) -> None:
        self._ask(feature, lambda node: node.set_value(value))

    def set_integer(self, feature: str, value: int) -> None:
        self._ask(feature, lambda node: node.set_value(value))

    def steps(self, feature: str) -> tuple[int, int]:
        return self._ask(feature, lambda node: (int(node.min), max(int(node.inc), 1)))

    def address(self) -> str:
        return ""

    def execute(self, feature: str) -> None:
        self._ask(feature, lambda node: node.execute())

    def entries(self, feature: str) -> tuple[str, ...]:
        from genicam import genapi

        entries = self._ask(feature, lambda node: node.entries)
        return tuple(one.symbolic for one in entries if genapi.is_available(one))

    def tick_frequency(self) -> int:
        """Return the ticks of the time stamps in a second; 0 if the producer does not know."""
        return int(_fact(self._acquirer.device, "timestamp_frequency") or 0)

    def start(self) -> None:
        """Allocate buffers and start the acquisition."""
        with _translated(self.serial):
            self._acquirer.num_buffers = max(BUFFERS, self._acquirer.min_num_buffers)
            self._acquirer.start()

    def next_image(self, timeout_s: float) -> Image | None:
        """Return the next buffer, which replaces the one before, or None."""
        self._incomplete.clear()
        with _translated(self.serial):
            if self._taken is not None:
                self._taken.parent.queue_buffer(self._taken)
                self._taken = None
            # A time of zero would be one without end.
            taken = self._acquirer.try_fetch(timeout=max(timeout_s, _LEAST_S), is_raw=True)
            if taken is None:
                nothing = np.zeros(0, np.uint8)
                return Image(1, 0, 0, 0, 0, 0, nothing) if self._incomplete else None
            self._taken = taken
            # The length that a producer states can exceed the buffer, or its filled part.
            data = np.frombuffer(taken.raw_buffer, np.uint8)[: taken.size_filled]
            return Image(
                0, taken.frame_id, _fact(taken, "timestamp_ns") or 0, taken.pixel_format,
                taken.width, taken.height, data[_fact(taken, "image_offset") or 0 :],
                _fact(taken, "offset_x") or 0, _fact(taken, "offset_y") or 0,
            )  # fmt: skip

    def close(self) -> None:
        """Stop and release the camera; idempotent."""
        acquirer, self._acquirer, self._taken = self._acquirer, None, None
        # An unplugged camera cannot be stopped.
        with contextlib.suppress(AcquisitionError), _translated(self.serial):
            if acquirer is not None:
                acquirer.destroy()


@contextlib.contextmanager
def _translated(serial: str) -> Iterator[None]:
    """Raise errors of producers and node maps as AcquisitionError."""
    from genicam import genapi, gentl

    try:
        yield
    except (gentl.ResourceInUseException, gentl.AccessDeniedException) as error:
        raise is_controlled(serial) from error
    except (gentl.GenericException, genapi.GenericException, AttributeError) as error:
        # Without the place in the source of the library.
        text = _PLACE.sub("", " ".join(str(error).split())).rstrip(".")
        raise is_refused(serial, text) from error


def _fact(module: Any, name: str) -> Any:
    """Return a fact about a device or buffer; None if the producer does not know it."""
    from genicam import gentl

    with contextlib.suppress(gentl.GenericException, AttributeError):
        return getattr(module, name)
    return None
