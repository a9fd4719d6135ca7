"""Scene of `calibrating`: a hand sweeps the probe about its ball in a cone."""

from __future__ import annotations

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.camera import Vector3
from ocmm_core.geometry import Float, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody, satisfies_rules
from ocmm_sim.scene import kernels

_LIFT_MM, _LIFT_S = 60.0, 0.5
_WAY_S = 0.55
"""Between turning points of the hand."""

_JUMP_S = 0.03
_PATCH_RAD = 0.3


class ScriptedJump(msgspec.Struct, frozen=True, kw_only=True):
    """A push of the cone."""

    at_s: float
    shift_mm: Vector3


class SeatFault(msgspec.Struct, frozen=True, kw_only=True):
    """A worn cone, or a ball that is not round."""

    worn_mm: Vector3 = (0.0, 0.0, 0.0)
    """Shift of the ball along X, Y and Z of the world per radian of tilt: across by the tilt about
    that axis, upwards by half its square."""
    wall_mm: float = 0.0
    """Play: the ball lies at this distance from the axis, on the side to which the probe leans."""
    dirt_mm: float = 0.0
    dirt_probe: Vector3 = (0.0, 0.0, -1.0)
    """`dirt_mm`, `dirt_probe`: height and direction of a patch 17 degrees wide on the ball."""
    lobes_mm: float = 0.0
    """Amplitude of three lobes about the handle, at 30 degrees from the pole."""

    def shifts(self, rotations: Float) -> Float:
        """Return the shift of the ball, (n, 3), mm, for rotations (n, 3, 3), world from probe."""
        tilt = rotations[:, :2, 2]
        lean = np.linalg.norm(tilt, axis=1)
        found: Float = np.column_stack([tilt, 0.5 * lean**2]) * np.array(self.worn_mm)
        found[:, :2] += self.wall_mm * tilt / np.maximum(lean, 1e-9)[:, None]
        # The place of the ball that rests in the cone is opposite to the world's vertical.
        down = -rotations[:, 2]
        angle = np.arccos(np.clip(down @ unit(np.array(self.dirt_probe)), -1.0, 1.0))
        found[:, 2] += self.dirt_mm * np.exp(-((angle / _PATCH_RAD) ** 2))
        around = np.arctan2(down[:, 1], down[:, 0])
        found[:, 2] += self.lobes_mm * np.cos(3.0 * around) * 2.0 * np.hypot(down[:, 0], down[:, 1])
        return found


class SweepProbe(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The ball is seated in a cone, the probe swept about it, and lifted off."""

    cone: Vector3
    """Ball centre, mm, world."""
    seconds: float
    seed: int
    reach_deg: Vector3 = (27.0, 27.0, 12.0)
    """Amplitudes of leaning about X and Y, and of turning about the handle (Z)."""
    lean_deg: Vector3 = (0.0, 0.0, 0.0)
    """Mean attitude, from upright."""
    slack_mm: float = 0.0
    """Standard deviation of the ball's wander in the cone, per axis."""
    jumps: tuple[ScriptedJump, ...] = ()
    tip_shift_mm: Vector3 = (0.0, 0.0, 0.0)
    """Ball offset of another stylus, probe frame."""
    seat: SeatFault = SeatFault()
    hidden: tuple[int, ...] = ()
    """LEDs, from 0, covered by a hand."""


def sweep_segments(scene: SweepProbe, body: ProbeBody) -> Float:
    """Return segments of tip and probe for `kernels.move`."""
    rng = np.random.default_rng([scene.seed, 51])
    place = np.array(scene.cone)
    above = np.array([0.0, 0.0, _LIFT_MM])
    turn = _attitude(np.array(scene.lean_deg))
    sway = scene.slack_mm
    rows = [_way(0.0, _LIFT_S, place + above, place, turn, turn, sway)]
    jumps = list(scene.jumps)
    while (time := float(rows[-1][kernels.T1])) < scene.seconds + _LIFT_S:
        if jumps and time >= jumps[0].at_s:
            pushed = place + np.array(jumps.pop(0).shift_mm)
            rows.append(_way(time, _JUMP_S, place, pushed, turn, turn, sway))
            place = pushed
            continue
        aim = turn
        for _ in range(20):
            aim = _attitude(
                np.array(scene.lean_deg) + rng.uniform(-1.0, 1.0, 3) * np.array(scene.reach_deg)
            )
            if satisfies_rules(body, rotation_from_vector(aim)):
                break
        rows.append(_way(time, _WAY_S, place, place, turn, aim, sway))
        turn = aim
    rows.append(_way(time, _LIFT_S, place, place + above, turn, turn, sway))
    return np.array(rows)


def hidden_bits(scene: SweepProbe) -> int:
    """Return the hidden LEDs as bits."""
    return sum(1 << led for led in scene.hidden)


def _attitude(angles_deg: Float) -> Float:
    """Return the rotation vector (3,), rad, of a probe turned about Z, then leaned."""
    x, y, z = np.radians(angles_deg)
    leaned = rotation_from_vector(np.array([x, y, 0.0]))
    turned = leaned @ rotation_from_vector(np.array([0.0, 0.0, z]))
    vector: Float = Rotation.from_matrix(turned).as_rotvec()
    return vector


def _way(
    start_s: float, length_s: float, begin: Float, end: Float, w0: Float, w1: Float, sway: float
) -> Float:
    way = np.zeros(kernels.N_COLUMNS)
    way[kernels.T0], way[kernels.T1] = start_s, start_s + length_s
    way[kernels.KIND], way[kernels.TOP] = kernels.MOVE, np.nan
    way[kernels.SWAY0] = way[kernels.SWAY1] = sway
    way[kernels.P0 : kernels.P0 + 3], way[kernels.P1 : kernels.P1 + 3] = begin, end
    way[kernels.W0 : kernels.W0 + 3], way[kernels.W1 : kernels.W1 + 3] = w0, w1
    return way
