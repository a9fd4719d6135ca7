"""A GenICam camera, and its client library (`AravisCameras`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

COMPLETE = 0
"""Status of a buffer with all its packets; others carry a stale number and old pixels."""


@dataclass(frozen=True, slots=True)
class Image:
    """One buffer; `data` is valid until the next `Camera.next_image`."""

    status: int
    number: int
    """Block id of the transport; 16 bits wide in most cameras, and never 0."""
    time_ns: int
    """Time of the exposure on the clock of the camera."""
    pixel_format: int
    """Code of the Pixel Format Naming Convention."""
    width: int
    height: int
    data: NDArray[np.uint8]


class Camera(Protocol):
    """One camera that this program controls; for one thread."""

    @property
    def serial(self) -> str: ...
    @property
    def model(self) -> str:
        """Return maker and model."""
        ...

    def has(self, feature: str) -> bool: ...
    def text(self, feature: str) -> str:
        """Return the value of a feature of any kind; switches are ``true`` or ``false``."""
        ...

    def number(self, feature: str) -> float: ...
    def integer(self, feature: str) -> int: ...
    def set_text(self, feature: str, value: str) -> None:
        """Set a feature of any kind."""
        ...

    def set_number(self, feature: str, value: float) -> None: ...
    def set_integer(self, feature: str, value: int) -> None: ...
    def execute(self, feature: str) -> None: ...
    def entries(self, feature: str) -> tuple[str, ...]:
        """Return the values of an enumeration that can be set now."""
        ...

    def tick_frequency(self) -> int:
        """Return the ticks of the time stamps in a second; 0: stamps are those of this computer."""
        ...

    def start(self) -> None:
        """Allocate buffers and start the acquisition."""
        ...

    def next_image(self, timeout_s: float) -> Image | None:
        """Return the next buffer, or None."""
        ...

    def close(self) -> None:
        """Stop and release the camera; idempotent."""
        ...


class Cameras(Protocol):
    """Finds cameras and takes control of them."""

    def open(self, serial: str) -> Camera:
        """Take control of a camera; AcquisitionError if absent or controlled by others."""
        ...
