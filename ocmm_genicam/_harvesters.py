"""GenICam cameras by GenTL producers of their makers, with the package Harvesters.

A producer is a library (.cti) of a maker's kit. It reaches cameras that Aravis does not: CoaXPress,
Camera Link HS, USB3 Vision, and GigE Vision by the driver of the maker.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_core.documents import files_of_folder
from ocmm_core.errors import AcquisitionError
from ocmm_genicam._aravis import BUFFERS, FRAME_KEPT_US, AravisCameras
from ocmm_genicam._client import Cameras, Image

PATH_VARIABLE = "GENICAM_GENTL64_PATH"
"""Folders of the producers, set by the kits of the makers."""
_INCOMPLETE = 1
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
        # It logs each refusal with a traceback; they are raised, too.
        logging.getLogger("harvesters").setLevel(logging.CRITICAL)
        self._producers = ", ".join(file.name for file in files)
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
            others = ", ".join(f"{one} ({model})" for one, (_, model) in self._found.items())
            raise AcquisitionError(
                "genicam.absent",
                f"Camera {serial} was not found by {self._producers}. Cameras found: "
                f"{others or 'none'}.",
                "Check power and cable, and that the viewer of the maker shows the camera; a "
                "producer stays in the folder of its kit.",
            )
        device, model = self._found[serial]
        with _translated(serial), _kept_interrupt():
            acquirer = self._harvester.create(device)
        return GenTLCamera(self._core, acquirer, serial, model)


class GenTLCamera:
    """One camera, see `Camera`."""

    def __init__(self, core: Any, acquirer: Any, serial: str, model: str) -> None:
        self.serial, self.model = serial, model
        self._acquirer, self._nodes = acquirer, acquirer.remote_device.node_map
        self._taken: Any = None
        self._closed = False
        self._corner = {"X": 0, "Y": 0}
        self._n_incomplete = 0
        counted = type("Counted", (core.Callback,), {"emit": lambda _self, _of: self._count()})
        acquirer.add_callback(acquirer.Events.INCOMPLETE_BUFFER, counted())

    def _count(self) -> None:
        self._n_incomplete += 1

    def _node(self, feature: str) -> Any:
        node = getattr(self._nodes, feature, None)
        if node is None:
            raise AcquisitionError(
                "genicam.feature",
                f"Camera {self.serial} has no feature {feature}.",
                "Update the firmware of the camera, or use another model.",
            )
        return node

    def has(self, feature: str) -> bool:
        from genicam import genapi

        node = getattr(self._nodes, feature, None)
        with _translated(self.serial):
            return node is not None and bool(genapi.is_available(node))

    def text(self, feature: str) -> str:
        with _translated(self.serial):
            return str(self._node(feature).to_string())

    def number(self, feature: str) -> float:
        with _translated(self.serial):
            return float(self._node(feature).value)

    def integer(self, feature: str) -> int:
        with _translated(self.serial):
            return int(self._node(feature).value)

    def set_text(self, feature: str, value: str) -> None:
        with _translated(self.serial):
            self._node(feature).from_string(value)

    def set_number(self, feature: str, value: float) -> None:
        with _translated(self.serial):
            self._node(feature).value = value

    def set_integer(self, feature: str, value: int) -> None:
        with _translated(self.serial):
            self._node(feature).value = value

    def steps(self, feature: str) -> tuple[int, int]:
        with _translated(self.serial):
            node = self._node(feature)
            return int(node.min), max(int(node.inc), 1)

    def address(self) -> str:
        return ""

    def execute(self, feature: str) -> None:
        with _translated(self.serial):
            self._node(feature).execute()

    def entries(self, feature: str) -> tuple[str, ...]:
        from genicam import genapi

        with _translated(self.serial):
            return tuple(
                one.symbolic for one in self._node(feature).entries if genapi.is_available(one)
            )

    def tick_frequency(self) -> int:
        """Return the ticks of the time stamps in a second; 0 if the producer does not know."""
        return int(_fact(self._acquirer.device, "timestamp_frequency") or 0)

    def start(self) -> None:
        """Allocate buffers and start the acquisition."""
        with _translated(self.serial):
            # Some producers do not tell the place of an image.
            self._corner = {
                one: self.integer(f"Offset{one}") if self.has(f"Offset{one}") else 0 for one in "XY"
            }
            self._acquirer.num_buffers = max(BUFFERS, self._acquirer.min_num_buffers)
            self._acquirer.start()

    def next_image(self, timeout_s: float) -> Image | None:
        """Return the next buffer, which replaces the one before, or None."""
        counted = self._n_incomplete
        with _translated(self.serial):
            if self._taken is not None:
                self._taken.parent.queue_buffer(self._taken)
                self._taken = None
            # A time of zero would be one without end.
            taken = self._acquirer.try_fetch(timeout=max(timeout_s, _LEAST_S), is_raw=True)
            if taken is None:
                nothing = np.zeros(0, np.uint8)
                lost = self._n_incomplete > counted
                return Image(_INCOMPLETE, 0, 0, 0, 0, 0, nothing) if lost else None
            self._taken = taken
            # What the producer states may be longer than the buffer, or than what was filled.
            data = np.frombuffer(taken.raw_buffer, np.uint8)[: taken.size_filled]
            return Image(
                0, taken.frame_id, self._time_ns(taken), taken.pixel_format, taken.width,
                taken.height, data[_fact(taken, "image_offset") or 0 :],
                *(self._corner[axis] if (found := _fact(taken, f"offset_{axis.lower()}")) is None
                  else found for axis in "XY"),
            )  # fmt: skip

    def _time_ns(self, buffer: Any) -> int:
        time_ns = _fact(buffer, "timestamp_ns")
        ticks, per_s = _fact(buffer, "timestamp"), self.tick_frequency()
        if time_ns is None and ticks is not None and per_s:
            time_ns = ticks * 1_000_000_000 // per_s
        return int(time_ns or 0)

    def close(self) -> None:
        """Stop and release the camera; idempotent."""
        if self._closed:
            return
        self._closed = True
        # An unplugged camera cannot be stopped.
        with contextlib.suppress(AcquisitionError), _translated(self.serial):
            self._acquirer.destroy()
        self._taken = None


@contextlib.contextmanager
def _translated(serial: str) -> Iterator[None]:
    """Raise errors of producers and node maps as AcquisitionError."""
    from genicam import genapi, gentl

    try:
        yield
    except (gentl.ResourceInUseException, gentl.AccessDeniedException) as error:
        raise AcquisitionError(
            "genicam.controlled",
            f"Camera {serial} is controlled by another program.",
            "Close that program. After a crash a camera stays reserved for some seconds: wait, "
            "then open the job again.",
        ) from error
    except (gentl.GenericException, genapi.GenericException, AttributeError) as error:
        # Without the place in the source of the library.
        text = _PLACE.sub("", " ".join(str(error).split())).rstrip(".")
        raise AcquisitionError(
            "genicam.camera",
            f"Camera {serial}: {text}.",
            "Check cable, power and network of the camera, then open the job again.",
        ) from error


@contextlib.contextmanager
def _kept_interrupt() -> Iterator[None]:
    """Keep the handler of interrupts, which Harvesters replaces in the main thread."""
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, before)


def _fact(module: Any, name: str) -> Any:
    """Return a fact about a device or buffer; None if the producer does not know it."""
    from genicam import gentl

    with contextlib.suppress(gentl.GenericException, AttributeError):
        return getattr(module, name)
    return None
