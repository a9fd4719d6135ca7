"""Array types of pictures, and what stands in them where nothing is painted."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Depths: TypeAlias = NDArray[np.float32]
"""(height, width), mm towards the eye; `NOWHERE` where nothing is painted."""

FaceNumbers: TypeAlias = NDArray[np.int32]
"""Places of faces or vertices in their lists; `NO_FACE` for none."""

Flags: TypeAlias = NDArray[np.uint8]
"""(m,), 0 or 1."""

Pixmap: TypeAlias = NDArray[np.uint32]
"""(height, width), 0xAARRGGBB with colours times alpha; 0 where nothing is painted."""

Shades: TypeAlias = NDArray[np.float32]
"""(n, 3), red, green, blue with their light, 0 to 255."""

Colours: TypeAlias = NDArray[np.uint8]
"""(n, 3), red, green, blue of vertices."""

NOWHERE = np.float32(-np.inf)
NO_FACE = -1
