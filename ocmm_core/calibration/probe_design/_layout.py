"""Least possible tip error of an LED layout as seen by a rig, and ambiguity of its labels.

Cramer-Rao bound of the pose for white spot noise and exact cameras and LEDs. The product's
estimator reaches it within two per cent, so no simulated frames are needed. Labels are compared
also with hidden LEDs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocmm_core import tracking
from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.geometry import Float, rotation_xyz
from ocmm_core.tracking.kernels import MAX_TIP_SIGMA


@dataclass(frozen=True, slots=True)
class WrongLabels:
    """The wrong labelling closest to the body."""

    hidden: int
    """Number of the unseen LED, from 1; 0 if all are seen."""
    ambiguity: tracking.Ambiguity | None
    """LEDs assigned to the places of the visible ones; None if the rules exclude all."""

    @property
    def is_safe(self) -> bool:
        """Return whether the labels cannot be confused."""
        found = self.ambiguity
        return found is None or found.residual_mm >= tracking.AMBIGUITY_LIMIT_MM


def wrong_labels(body: tracking.ProbeBody) -> tuple[WrongLabels, ...]:
    """Return the nearest wrong labelling with all LEDs and with each hidden (none of three)."""
    everything = tuple(range(body.n_leds))
    found = [WrongLabels(0, tracking.nearest_ambiguity(body))]
    if body.n_leds > 3:
        for hidden in everything:
            seen = tuple(led for led in everything if led != hidden)
            found.append(WrongLabels(hidden + 1, tracking.nearest_ambiguity(body, seen)))
    return tuple(found)


_CHUNK = 1000
_AT_ONCE = 24
"""Poses averaged in a cell of a map."""


@dataclass(frozen=True, slots=True)
class Postures:
    """Distribution of attitudes and places of the probe."""

    tilt_deg: tuple[float, float, float]
    """About X, Y and Z of the world: uniform between minus and plus this."""
    volume_world: Float
    """(2, 3), mm: corners; the ball is uniformly distributed between them."""

    def draw(self, n: int, rng: np.random.Generator) -> tuple[Float, Float]:
        """Return rotations world from probe (n, 3, 3) and places of the ball (n, 3), mm."""
        angles = np.radians(rng.uniform(-1.0, 1.0, (n, 3)) * self.tilt_deg)
        low, high = self.volume_world
        return _rotations(angles), low + (high - low) * rng.random((n, 3))


@dataclass(frozen=True, slots=True)
class View:
    """Rig and layout to evaluate."""

    rig: Rig
    body: tracking.ProbeBody
    sigma_px: float
    everything_seen: bool = False
    """Also count LEDs that face away from a camera as seen."""

    def covariance(self, rotations: Float, tips_world: Float) -> Float:
        """Return the bound (n, 3, 3), mm^2, of poses, world from probe; NaN if undetermined."""
        bound = np.empty((len(tips_world), 3, 3))
        for start in range(0, len(bound), _CHUNK):
            part = slice(start, start + _CHUNK)
            found = tracking.tip_derivatives(
                self.spots(rotations[part], tips_world[part]), self.rig, self.body
            )
            some = self.sigma_px**2 * found.by_spots @ found.by_spots.transpose(0, 2, 1)
            some[~found.answered | (np.einsum("nii->n", some) > MAX_TIP_SIGMA**2)] = np.nan
            bound[part] = some
        return bound

    def spots(self, rotations: Float, tips_world: Float) -> Float:
        """Return the spots of the LEDs, (n, C, L, 2), px; NaN if unseen."""
        arms = self.body.leds_probe - self.body.tip_probe
        places = np.einsum("nij,lj->nli", rotations, arms) + tips_world[:, None]
        light = np.einsum("nij,lj->nli", rotations, self.body.led_directions_probe)
        uv = np.empty((len(places), len(self.rig.cameras), self.body.n_leds, 2))
        least = np.cos(self.body.emission_half_angle)
        for index, camera in enumerate(self.rig.cameras):
            uv[:, index] = project(camera, places)
            if not self.everything_seen:
                ray = camera.centre_world - places
                facing = np.sum(ray * light, axis=2) > least * np.linalg.norm(ray, axis=2)
                uv[:, index][~(facing & on_sensor(camera, uv[:, index]))] = np.nan
        return uv


@dataclass(frozen=True, slots=True)
class TipNumber:
    """The error of the tip over many poses."""

    axes_um: tuple[float, float, float]
    """RMS along X, Y and Z of the world."""
    space_um: float
    """RMS of the distance."""
    p95_um: float
    """RMS distance that 95 % of the poses stay below."""
    share: float
    """Fraction of determined poses."""


@dataclass(frozen=True, slots=True)
class TipMap:
    """The error of the tip over two quantities."""

    title: str
    names: tuple[str, str]
    """`title`, `names`: Title, and names of columns and rows with units."""
    columns: Float
    rows: Float
    """`columns`, `rows`: (n,) and (m,): values at the middle of the cells."""
    space_um: Float
    """(m, n): RMS distance; NaN if nothing is seen."""


def tip_number(view: View, postures: Postures, poses: int, seed: int) -> TipNumber:
    """Return the tip error of a layout; NaN without a determined pose."""
    bound = view.covariance(*postures.draw(poses, np.random.default_rng(seed)))
    variances = 1e6 * np.einsum("nii->ni", bound)
    good = np.isfinite(variances).all(axis=1)
    if not good.any():
        return TipNumber((np.nan, np.nan, np.nan), np.nan, np.nan, 0.0)
    axes = np.sqrt(variances[good].mean(axis=0))
    distances = np.sqrt(variances[good].sum(axis=1))
    return TipNumber(
        axes_um=(float(axes[0]), float(axes[1]), float(axes[2])),
        space_um=float(np.linalg.norm(axes)),
        p95_um=float(np.quantile(distances, 0.95)),
        share=float(good.mean()),
    )


def tilt_map(view: View, postures: Postures, cells: int, seed: int) -> TipMap:
    """Return the error over the tilts about X and Y, averaged over the volume."""
    about_x, about_y = (
        np.linspace(-1.0, 1.0, cells) * (angle or 1.0) for angle in postures.tilt_deg[:2]
    )
    # The same places in every cell: the map shows the tilt, not the drawn places.
    rng = np.random.default_rng(seed)
    _, tips = postures.draw(_AT_ONCE, rng)
    turns = rng.uniform(-1.0, 1.0, _AT_ONCE) * postures.tilt_deg[2]

    def poses(x: float, y: float) -> tuple[Float, Float]:
        angles = np.radians(np.column_stack([np.full(_AT_ONCE, x), np.full(_AT_ONCE, y), turns]))
        return _rotations(angles), tips

    return TipMap(
        "Over the tilt of the probe",
        ("tilt about X / °", "tilt about Y / °"),
        about_x,
        about_y,
        _cells(view, about_x, about_y, poses),
    )


def volume_map(view: View, postures: Postures, cells: int, seed: int, *, top: bool) -> TipMap:
    """Return the error over the volume, averaged over tilts, from above or from the front."""
    rotations, drawn = postures.draw(_AT_ONCE, np.random.default_rng(seed))
    low, high = postures.volume_world
    other = 1 if top else 2
    across, along = (np.linspace(low[axis], high[axis], cells) for axis in (0, other))

    def poses(x: float, y: float) -> tuple[Float, Float]:
        tips = drawn.copy()
        tips[:, 0], tips[:, other] = x, y
        return rotations, tips

    name = ("From above", "Y, away from the cameras / mm") if top else ("From the front", "Z / mm")
    return TipMap(
        f"Over the volume. {name[0]}",
        ("X / mm", name[1]),
        across,
        along,
        _cells(view, across, along, poses),
    )


def _cells(
    view: View, columns: Float, rows: Float, poses: Callable[[float, float], tuple[Float, Float]]
) -> Float:
    drawn = [poses(float(column), float(row)) for row in rows for column in columns]
    bound = view.covariance(
        np.concatenate([rotations for rotations, _ in drawn]),
        np.concatenate([tips for _, tips in drawn]),
    )
    squares = np.einsum("nii->n", bound).reshape(len(rows), len(columns), _AT_ONCE)
    good = np.isfinite(squares)
    count = np.count_nonzero(good, axis=2)
    total = np.where(good, squares, 0.0).sum(axis=2)
    # A mean over a minority of determined poses would be misleading.
    known = 2 * count >= _AT_ONCE
    return np.where(known, 1e3 * np.sqrt(total / np.maximum(count, 1)), np.nan)


def _rotations(angles: Float) -> Float:
    return np.stack([rotation_xyz(*row) for row in angles])
