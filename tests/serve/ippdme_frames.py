"""Coordinate systems of I++ DME, from the table of the specification (shift of form A)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
CHAIN = ("MultipleArmCsy", "MoveableMachineCsy", "PartCsy")
"""Each is given in the system before it; the first one in the machine's."""


def rotation(theta: float, psi: float, phi: float) -> Array:
    """Return M of v' = M v, parent to child; degrees."""
    (ct, cp, cf), (st, sp, sf) = (
        function(np.radians([theta, psi, phi])) for function in (np.cos, np.sin)
    )
    return np.array(
        [
            [cp * cf - ct * sp * sf, sp * cf + ct * cp * sf, st * sf],
            [-cp * sf - ct * sp * cf, -sp * sf + ct * cp * cf, st * cf],
            [st * sp, -st * cp, ct],
        ]
    )


def to_active(
    point: Array, active: str, given: Mapping[str, Sequence[float]], *, vector: bool = False
) -> Array:
    """Return a point of the machine (3,) in the active system; a direction if `vector`."""
    for name in CHAIN[: CHAIN.index(active) + 1] if active in CHAIN else ():
        numbers = given.get(name, (0.0,) * 6)
        origin = np.zeros(3) if vector else np.array(numbers[:3])
        point = rotation(*numbers[3:]) @ (point - origin)
    return point
