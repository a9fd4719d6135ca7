"""Averaged spots: their table, and the assignment to LEDs without valid camera poses.

::

    # ocmm shots
    # sigma: 0.0105
    shot;kind;place;serial;led;u;v
    1;pose;;20330001;1;312.4471;1766.0312

One row for each spot; rows of a shot need not be adjacent. ``kind`` is ``pose`` (the waved probe),
``bar`` (its two LEDs), ``seat`` (the ball in the control point ``place``; without a place, in an
end of the bar), ``repeat`` (in the next of the two seats that a relocation visits first and again
at its end), ``nest`` (in the next nest of the current line), ``sphere`` (on its next point) or
``cone`` (in the next attitude). ``led`` counts from 1 in the order of the probe document. ``sigma``
is the standard deviation of a spot, px per axis. Separators and decimal signs: `ocmm_core.tables`.

A moved frame does not allow `tracking.identify` to intersect rays. For every order of the LEDs,
each camera finds the scaled-orthographic pose; the few that fit are refined with perspective, and
cameras must roughly agree on the attitude. The labelling must be clearly better than all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ocmm_core.camera import CameraModel, Rig, ideal_from_pixels
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, Pixels, RigidTransform, rotation_from_vector, skew
from ocmm_core.tables import TableAccount, TableOptions, TextRow, TextTable, read_pixels
from ocmm_core.tracking import ProbeBody

ShotKind = Literal["pose", "bar", "seat", "repeat", "nest", "sphere", "cone"]

_COLUMNS = ("shot", "kind", "place", "serial", "led", "u", "v")


@dataclass(frozen=True, slots=True)
class Shot:
    """Simultaneous averaged spots."""

    kind: ShotKind
    place: str
    uv: Pixels
    """(C, L, 2), px, by LED; (C, 2, 2) for the bar; NaN if unseen."""
    sigma_px: float
    """Standard deviation of a spot, px per axis."""


@dataclass(frozen=True, slots=True)
class ShotTable:
    """Recorded shots in the order of their first rows, and the account of the reader."""

    shots: tuple[Shot, ...]
    account: TableAccount


def load_shots(
    path: Path | str, rig: Rig, n_leds: int, options: TableOptions | None = None
) -> ShotTable:
    """Return the shots of the table at ``path``.

    InputError: not such a table, or a row has an unknown kind, camera or LED, repeats a spot, or
    contradicts an earlier row of its shot.
    """
    found = read_pixels(path, _COLUMNS, options)
    table = found.table
    rows_of = {str(camera.serial): index for index, camera in enumerate(rig.cameras)}
    shots: dict[str, Shot] = {}
    for row in table.rows:
        kind = next((one for one in get_args(ShotKind) if one == row.cells["kind"]), None)
        if kind is None:
            raise _wrong(
                table, row.line, f"{row.cells['kind']!r} is not a kind of shot",
                f"Write {', '.join(get_args(ShotKind))}.",
            )  # fmt: skip
        count = 2 if kind == "bar" else n_leds
        shot = shots.get(row.cells["shot"])
        if shot is None:
            uv = np.full((len(rig.cameras), count, 2), np.nan)
            shot = shots[row.cells["shot"]] = Shot(kind, row.cells["place"], uv, found.sigma_px)
        if (shot.kind, shot.place) != (kind, row.cells["place"]):
            raise _wrong(
                table, row.line, f"shot {row.cells['shot']!r} has another kind or place above",
                "Number every shot uniquely.",
            )  # fmt: skip
        camera = rows_of.get(row.cells["serial"])
        if camera is None:
            raise _wrong(
                table, row.line, f"rig '{rig.name}' has no camera {row.cells['serial']!r}",
                "Select the rig the shots were taken with.",
            )  # fmt: skip
        led = _led(table, row, count)
        if np.isfinite(shot.uv[camera, led, 0]):
            raise _wrong(table, row.line, "this spot occurs already", "Keep one of the rows.")
        shot.uv[camera, led] = found.uv(row)
    return ShotTable(tuple(shots.values()), found.account)


def _led(table: TextTable, row: TextRow, count: int) -> int:
    text = row.cells["led"]
    if not text.isdecimal() or not 1 <= int(text) <= count:
        raise _wrong(table, row.line, f"there is no LED {text!r}", f"Write 1 to {count}.")
    return int(text) - 1


def _wrong(table: TextTable, line: int, what: str, remedy: str) -> InputError:
    return InputError("shots.row", f"{table.path}, line {line}: {what}.", remedy)


MIN_SPOTS = 5
"""Fewer fit too many orders of the LEDs."""

_FLAT_MM = 5.0
"""A body that is thinner than this has no scaled-orthographic pose."""

_ORTHOGRAPHIC_MM = 8.0
"""Effect of perspective on a body of 100 mm at a metre."""

_PERSPECTIVE = 2.5e-3
"""Residual, relative to the distance, of a lens with 2 % error."""

_MAX_TURN = np.radians(6.0)
"""Maximum disagreement of the cameras on the attitude of the probe."""

_CLEARLY_BETTER = 3.0
_STEPS = 8


@dataclass(frozen=True, slots=True)
class _Named:
    """One order of the LEDs: ``leds`` (k,), ``miss``: RMS residual over the distance."""

    leds: tuple[int, ...]
    T_camera_from_probe: RigidTransform
    miss: float


def label_roughly(rig: Rig, body: ProbeBody, spots: Float) -> Int | None:
    """Return the slot of each LED, (C, L), -1 if none; None if ambiguous.

    ``spots`` (C, 8, 2), px: one frame, NaN if empty. Attitudes of the rig may be off by a few
    degrees, focal lengths by a few percent; positions are not used.
    """
    thickness = np.linalg.svd(body.leds_probe - body.leds_probe.mean(axis=0))[1][2]
    if thickness < _FLAT_MM:
        return None
    slots = [np.flatnonzero(np.isfinite(of_camera).all(axis=1)) for of_camera in spots]
    if any(not MIN_SPOTS <= len(seen) <= body.n_leds for seen in slots):
        return None
    named = [_orders(camera, body, spots[c, slots[c]]) for c, camera in enumerate(rig.cameras)]
    ranked = sorted(
        (
            (float(np.hypot.reduce([one.miss for one in choice])), choice)
            for choice in product(*named)
            if _agree(rig, body, choice)
        ),
        key=lambda pair: pair[0],
    )
    if not ranked or (len(ranked) > 1 and ranked[1][0] < _CLEARLY_BETTER * ranked[0][0]):
        return None
    slot_of_led = np.full((len(rig.cameras), body.n_leds), -1, dtype=np.int64)
    for c, one in enumerate(ranked[0][1]):
        slot_of_led[c, list(one.leds)] = slots[c]
    return slot_of_led


def _orders(camera: CameraModel, body: ProbeBody, uv: Float) -> list[_Named]:
    """Return LED orders that fit the spots (k, 2) of one camera, the best first."""
    image = ideal_from_pixels(camera, uv) / camera.focal
    orders = np.array(list(permutations(range(body.n_leds), len(uv))))
    leds = body.leds_probe[orders]
    leds = leds - leds.mean(axis=1, keepdims=True)
    flat = image - image.mean(axis=0)
    maps = np.swapaxes(np.linalg.pinv(leds) @ flat, 1, 2)
    u, sizes, vt = np.linalg.svd(maps, full_matrices=False)
    scale = sizes.mean(axis=1)
    nearest = scale[:, None, None] * (u @ vt)
    miss_mm = np.sqrt(np.mean((leds @ np.swapaxes(nearest, 1, 2) - flat) ** 2, axis=(1, 2))) / scale
    found = []
    for index in np.flatnonzero(miss_mm < _ORTHOGRAPHIC_MM):
        rows = u[index] @ vt[index]
        rotation = np.stack([rows[0], rows[1], np.cross(rows[0], rows[1])])
        distance = 1.0 / scale[index]
        chosen = body.leds_probe[orders[index]]
        middle = np.append(image.mean(axis=0), 1.0) * distance
        start = RigidTransform(rotation, middle - rotation @ chosen.mean(axis=0))
        pose, miss = _refined(start, chosen, image)
        if miss < _PERSPECTIVE:
            found.append(_Named(tuple(int(led) for led in orders[index]), pose, miss))
    return sorted(found, key=lambda one: one.miss)


def _refined(start: RigidTransform, leds: Float, image: Float) -> tuple[RigidTransform, float]:
    """Return the pose of LEDs (k, 3) seen at normalised image points (k, 2), and its miss."""
    pose, miss = start, np.inf
    for _ in range(_STEPS):
        inside = pose.apply(leds)
        if inside[:, 2].min() <= 0.0:
            return pose, np.inf
        residual = image - inside[:, :2] / inside[:, 2:]
        miss = float(np.sqrt(np.mean(residual**2)))
        slope = np.zeros((len(leds), 2, 3))
        slope[:, 0, 0] = slope[:, 1, 1] = 1.0 / inside[:, 2]
        slope[:, :, 2] = -inside[:, :2] / inside[:, 2:] ** 2
        turning = np.stack([-skew(arm) for arm in leds @ pose.rotation.T])
        rows = np.concatenate([slope @ turning, slope], axis=2).reshape(-1, 6)
        step = np.linalg.lstsq(rows, residual.ravel())[0]
        pose = RigidTransform(
            rotation_from_vector(step[:3]) @ pose.rotation, pose.translation + step[3:]
        )
    return pose, miss


def _agree(rig: Rig, body: ProbeBody, choice: tuple[_Named, ...]) -> bool:
    """Return whether the cameras agree on the attitude and see only LEDs facing them."""
    attitudes = [
        camera.T_camera_from_world.rotation.T @ one.T_camera_from_probe.rotation
        for camera, one in zip(rig.cameras, choice, strict=True)
    ]
    for other in attitudes[1:]:
        cosine = 0.5 * (np.trace(attitudes[0].T @ other) - 1.0)
        if np.arccos(np.clip(cosine, -1.0, 1.0)) > _MAX_TURN:
            return False
    return all(_shines(body, one) for one in choice)


def _shines(body: ProbeBody, one: _Named) -> bool:
    pose, leds = one.T_camera_from_probe, list(one.leds)
    towards = -pose.apply(body.leds_probe[leds])
    light = body.led_directions_probe[leds] @ pose.rotation.T
    cosine = np.sum(towards * light, axis=1) / np.linalg.norm(towards, axis=1)
    widest = min(body.emission_half_angle + np.radians(10.0), np.pi)
    return bool((cosine > np.cos(widest)).all())
