"""Array types of images, and their background values."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Depths: TypeAlias = NDArray[np.float32]
"""(height, width), mm towards the eye; `NOWHERE` for background."""

FaceNumbers: TypeAlias = NDArray[np.int32]
"""Indices of faces or vertices; `NO_FACE` for none."""

Flags: TypeAlias = NDArray[np.uint8]
"""(m,), 0 or 1."""

Pixmap: TypeAlias = NDArray[np.uint32]
"""(height, width), 0xAARRGGBB with premultiplied alpha; 0 for background."""

Shades: TypeAlias = NDArray[np.float32]
"""(n, 3), red, green, blue after lighting, 0 to 255."""

Colours: TypeAlias = NDArray[np.uint8]
"""(n, 3), red, green, blue of vertices."""

NOWHERE = np.float32(-np.inf)
NO_FACE = -1
