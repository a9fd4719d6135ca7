"""Coordinate systems of the protocol, from the machine to the part. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from ocmm_core.geometry import Float, RigidTransform
from ocmm_serve.ippdme._grammar import DmeError

MACHINE = "MachineCsy"
CHAIN = (
    "MultipleArmCsy", "MoveableMachineCsy", "RotaryTableFixCsy", "RotaryTableVarCsy", "PartCsy",
)  # fmt: skip
"""Systems after the machine's, each relative to the one before it."""
SHOWN = ("JogDisplayCsy", "JogMoveCsy", "SensorCsy")
"""Systems of displays and sensors: stored and returned, without effect on numbers."""
_LARGEST_MM = 1e6


class ShiftSign(StrEnum):
    """Meaning of X0, Y0, Z0 of a transformation; the editions contradict each other."""

    ORIGIN = "origin"
    """Origin of the child in its parent: child = M (parent - X0)."""
    OFFSET = "offset"
    """Origin of the parent in the child: child = M parent + X0."""


@dataclass(frozen=True, slots=True)
class CsyTransformation:
    """Six numbers of a transformation: mm and degrees."""

    x0: float = 0.0
    y0: float = 0.0
    z0: float = 0.0
    theta: float = 0.0
    psi: float = 0.0
    phi: float = 0.0

    @property
    def values(self) -> tuple[float, ...]:
        return self.x0, self.y0, self.z0, self.theta, self.psi, self.phi

    def rotation(self) -> Float:
        """Return the rotation M (3, 3), parent to child: by psi, theta, phi about z, x, z."""
        theta, psi, phi = np.radians([self.theta, self.psi, self.phi])
        ct, cp, cf = math.cos(theta), math.cos(psi), math.cos(phi)
        st, sp, sf = math.sin(theta), math.sin(psi), math.sin(phi)
        return np.array([
            [cp * cf - ct * sp * sf, sp * cf + ct * cp * sf, st * sf],
            [-cp * sf - ct * sp * cf, -sp * sf + ct * cp * cf, st * cf],
            [st * sp, -st * cp, ct],
        ])  # fmt: skip

    def child_from_parent(self, sign: ShiftSign) -> RigidTransform:
        rotation, shift = self.rotation(), np.array([self.x0, self.y0, self.z0])
        if sign is ShiftSign.ORIGIN:
            return RigidTransform(rotation, -rotation @ shift)
        return RigidTransform(rotation, shift)


@dataclass(frozen=True, slots=True)
class CsyFrames:
    """All transformations, and the active system."""

    sign: ShiftSign = ShiftSign.ORIGIN
    active: str = MACHINE
    known: Mapping[str, CsyTransformation] = field(default_factory=dict)
    named: Mapping[str, CsyTransformation] = field(default_factory=dict)
    """`known`: by system; none is the identity. `named`: stored under a name of the client."""

    def transformation(self, name: str) -> CsyTransformation:
        return self.known.get(name, CsyTransformation())

    def activated(self, name: str) -> CsyFrames:
        """Return the frames with another active system; DmeError if unknown."""
        if name not in (MACHINE, *CHAIN):
            raise DmeError(505)
        return replace(self, active=name)

    def transformed(self, name: str, values: tuple[float, ...]) -> CsyFrames:
        """Return the frames with the transformation of a system; DmeError if invalid."""
        if name not in (*CHAIN, *SHOWN):
            raise DmeError(505)
        return replace(self, known={**self.known, name: checked(values)})

    def active_from_machine(self) -> RigidTransform:
        found = RigidTransform.identity()
        for name in CHAIN[: CHAIN.index(self.active) + 1] if self.active != MACHINE else ():
            found = self.transformation(name).child_from_parent(self.sign).compose(found)
        return found

    def note(self) -> Mapping[str, object]:
        """Return the systems for the job."""
        known = {name: one.values for name, one in self.known.items()}
        return {"active": self.active, "shift": self.sign, "transformations": known}

    @property
    def origin_words(self) -> str:
        """Return the origin of the active system in the machine's, for the operator."""
        origin = self.active_from_machine().inverse().translation
        x, y, z = (f"{value:.3f}" for value in origin.tolist())
        return f"{self.active}: its origin is at X {x} Y {y} Z {z} of the machine."


def checked(values: tuple[float, ...]) -> CsyTransformation:
    """Return six numbers as a transformation; DmeError out of range."""
    if not 0.0 <= values[3] <= 180.0:
        raise DmeError(1007)
    if max(map(abs, values)) > _LARGEST_MM:
        raise DmeError(509)
    return CsyTransformation(*values)
