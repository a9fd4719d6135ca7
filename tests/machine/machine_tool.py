"""Simulated machine tool: its cuts with given offsets, and its drifts from part to part.

Positions are built from the physical axes of the machine and of the clamped part, not from the
formulas of the corrections that are tested with them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Float = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WorkOffset:
    """Work offset in the control."""

    origin: tuple[float, float, float]
    """mm, machine axes."""
    turn_deg: float = 0.0
    """From X towards Y of the machine."""


@dataclass(frozen=True, slots=True)
class SimulatedMill:
    """Mill with a clamped part."""

    axes: Float
    """(3, 3): X, Y, Z of the machine as rows, in the part frame of a part clamped straight."""
    clamped: WorkOffset
    """The offset that is right for the part."""
    length: float = 100.0
    radius: float = 5.0
    """`length`, `radius`: true values of the tool, mm."""

    def cut_places(self, nominal: Float, offset: WorkOffset, length: float) -> Float:
        """Return where places (N, 3), part frame, are cut; `length` is that of the control."""
        x, y, z = self.axes
        turn = np.radians(offset.turn_deg)
        programmed = [nominal @ axis for axis in (x, y, z)]
        # The control turns the program in its own coordinates, and lifts the spindle.
        moved_x = programmed[0] * np.cos(turn) - programmed[1] * np.sin(turn) + offset.origin[0]
        moved_y = programmed[0] * np.sin(turn) + programmed[1] * np.cos(turn) + offset.origin[1]
        moved_z = programmed[2] + offset.origin[2] + length - self.length
        world = np.outer(moved_x, x) + np.outer(moved_y, y) + np.outer(moved_z, z)
        # The part itself is turned from X towards Y, about their common normal.
        clamped = self.clamped
        pose = Rotation.from_rotvec(np.radians(clamped.turn_deg) * np.cross(x, y))
        at = clamped.origin[0] * x + clamped.origin[1] * y + clamped.origin[2] * z
        cut: Float = pose.inv().apply(world - at)
        return cut

    def bore(self, nominal: float, radius: float) -> float:
        """Return the diameter of a bore; the control keeps the cutter `radius` from the wall."""
        return nominal - 2.0 * radius + 2.0 * self.radius

    def boss(self, nominal: float, radius: float) -> float:
        """Return the diameter of a boss."""
        return nominal + 2.0 * radius - 2.0 * self.radius


def turned(nominal: float, tool: float, offset: float) -> float:
    """Return a turned diameter by the true X of the tool and that in the control, radii in mm."""
    return nominal + 2.0 * (offset - tool)


@dataclass(frozen=True, slots=True)
class Process:
    """Errors of a turned diameter from part to part, mm."""

    scatter: float
    """Standard deviation."""
    wear: float = 0.0
    """Growth per part."""
    thermal: float = 0.0
    thermal_parts: float = 50.0
    """`thermal`, `thermal_parts`: growth of the warming machine, and the parts it takes (1/e)."""
    jumps: tuple[tuple[int, float], ...] = ()
    """Part and size, e.g. of a new batch of material or of an insert."""
    dead_parts: int = 0
    """Parts that are cut before the operator has loaded a correction."""

    def errors(self, count: int, rng: np.random.Generator) -> Float:
        """Return the errors of parts without corrections, (count,)."""
        part = np.arange(count)
        drift = self.wear * part + self.thermal * (1.0 - np.exp(-part / self.thermal_parts))
        for first, size in self.jumps:
            drift = drift + size * (part >= first)
        return drift + rng.normal(0.0, self.scatter, count)


class SimulatedLathe:
    """Lathe that turns one diameter, with an offset that a person loads late."""

    def __init__(self, process: Process, count: int, rng: np.random.Generator) -> None:
        self.uncorrected = process.errors(count, rng)
        """Errors without any correction, (count,)."""
        self.cut: list[float] = []
        """Errors of the parts cut so far."""
        self._dead = process.dead_parts
        self._waiting: list[tuple[int, float]] = []
        self._offset = 0.0

    def load(self, offset: float) -> None:
        """Give the operator a new X offset (counting diameters), mm."""
        self._waiting.append((len(self.cut) + self._dead, offset))

    def __iter__(self) -> Iterator[float]:
        """Cut all parts; yield the error of each."""
        for number, error in enumerate(self.uncorrected.tolist()):
            for first, offset in self._waiting:
                if first <= number:
                    self._offset = offset
            self._waiting = [one for one in self._waiting if one[0] > number]
            self.cut.append(error + self._offset)
            yield self.cut[-1]
