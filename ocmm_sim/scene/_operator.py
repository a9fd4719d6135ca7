"""Operator of the virtual rig: an open-loop script of touches on the true part.

Each touch is a travel, an approach along the surface normal, a dwell in contact with hand tremor, a
button press, and a retract. All motions have minimum jerk (Flash and Hogan 1985), so that dwells
are distinguishable. The motion is a pure function of time.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_sim.scene import _kernels as kernels
from ocmm_sim.scene._artefacts import Part
from ocmm_sim.scene._hand import ScriptedTouch, ScriptWriter, attitude_at, segment_of
from ocmm_sim.scene._surfaces import (
    HOLES,
    Artefact,
    ConeEntry,
    CylinderEntry,
    SphereEntry,
    TorusEntry,
    TouchedEntry,
    free_width,
)
from ocmm_sim.scene._touches import Contacts, farthest, hops, pace, sample, slide

Touches = Sequence[tuple[str, int]]
"""Feature names and number of touches of each, in order."""

REST_S = 0.5
DWELL_S = 0.45
_WINDOW_FRAMES = 28
"""Of a touch by a slow camera, after the press of the button."""
_APPROACH_MM = 8.0
_BORE_APPROACH = 0.8
"""Fraction of the way from axis to wall used as approach in a bore."""
_CLEARANCE_MM = 12.0
_HOME_ABOVE_MM = 40.0
_TREMOR = (2e-3, 0.10)
"""Amplitudes of attitude, rad, and place, mm."""
_TREMOR_WAVES = 4
_STREAM = 16
_SLIDE_MM_S = (10.0, 25.0)
_SPARE = 5
"""Additional points of a slide, for those that are left out."""


@dataclass(frozen=True, slots=True)
class Missing:
    """Missing points at the end of the script, as an operator reads them on screen."""

    touches: Touches
    """Features and number of missing points of each."""
    taken: Mapping[str, Sequence[Sequence[float]]]
    """Ball centres (n, 3), mm, world, of the recorded points by feature; none if absent."""


@dataclass(frozen=True, slots=True)
class Motion:
    """The probe at some times."""

    rotation_world_from_probe: Float
    """(n, 3, 3)."""
    tip_world: Float
    """(n, 3), mm: ball centre."""
    button: NDArray[np.bool_]
    in_contact: NDArray[np.bool_]
    """`button`, `in_contact`: (n,) bool."""

    def origin_world(self, tip_probe: Float) -> Float:
        """Return the origin of the probe frame (n, 3), mm, for a ball at `tip_probe` (3,)."""
        origin: Float = self.tip_world - self.rotation_world_from_probe @ tip_probe
        return origin


@dataclass(frozen=True, slots=True)
class _Timeline:
    """State that `Operator.extend` replaces atomically."""

    segments: Float
    touches: tuple[ScriptedTouch, ...]
    rounds: int

    @property
    def end_s(self) -> float:
        return float(self.segments[-1, kernels.T1])


class Operator:
    """The script; thread-safe between reading and extending; ``tip_radius``, mm, is true.

    ``paths``: distance of the points, mm, of features that the ball slides over; ``scans``: how.
    """

    def __init__(
        self,
        part: Part,
        tip_radius: float,
        touches: Touches,
        seed: int,
        period_s: float = 0.0,
        paths: Mapping[str, float] = MappingProxyType({}),
        scans: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._part, self._paths, self._scans = part, paths, scans
        self._dwell_s = max(DWELL_S, kernels.BUTTON_DOWN_S + _WINDOW_FRAMES * period_s)
        self._tip_radius = tip_radius
        self._seed = seed
        self._tremor = draw_tremor(np.random.default_rng([seed, _STREAM]))
        self._lock = threading.Lock()
        pose = part.T_world_from_part
        tops = [_top(entry) for entry in part.artefacts]
        highest = max(float(pose.apply(top)[:, 2].max()) for top in tops)
        self._safe_z = highest + _CLEARANCE_MM + tip_radius
        middle = pose.apply(np.array([entry.point for entry in part.artefacts])).mean(axis=0)
        self._home = np.array([middle[0], middle[1], self._safe_z + _HOME_ABOVE_MM])
        self._places: dict[str, Contacts] = {}
        rest = segment_of(
            0.0, REST_S, kernels.REST, self._home, self._home, np.zeros(3), np.zeros(3)
        )
        self._timeline = self._extended(_Timeline(rest[None], (), 0), touches, 0.0)

    @property
    def duration_s(self) -> float:
        """Return the end of the script, s."""
        return self._timeline.end_s

    @property
    def touches(self) -> tuple[ScriptedTouch, ...]:
        return self._timeline.touches

    @property
    def script(self) -> object:
        """Return what the motion follows: another object after each change."""
        return self._timeline

    def extend(self, touches: Touches, not_before_s: float) -> None:
        """Append touches at new points after the script's end, or `not_before_s` if later."""
        with self._lock:
            self._timeline = self._extended(self._timeline, touches, not_before_s)

    def complete(self, missing: Missing, not_before_s: float) -> None:
        """Append the touches that gave no point, at their original places.

        Other places may not determine the feature, for example all on one side of a slot.
        """
        with self._lock:
            self._timeline = self._extended(
                self._timeline, missing.touches, not_before_s, missing.taken
            )

    def interrupt(self, at_s: float) -> None:
        """End the script at a time, dropping unfinished touches."""
        with self._lock:
            old = self._timeline
            begun = old.segments[:, kernels.T0] < at_s
            begun[0] = True
            over = tuple(touch for touch in old.touches if touch.retract_s <= at_s)
            self._timeline = _Timeline(old.segments[begun], over, old.rounds)

    def touch(self, surface_world: Float, normal_world: Float, not_before_s: float) -> None:
        """Append one touch at a place of the world, on the part or off it; the ball stays near it.

        (3,), mm and unit. Past motion is dropped, so that thousands of touches cost no memory.
        """
        with self._lock:
            old = self._timeline
            writer = ScriptWriter(self._home, max(old.end_s, not_before_s), self._dwell_s)
            writer.follow(old.segments[-1])
            tip = surface_world + self._tip_radius * normal_world
            before = tip + _APPROACH_MM * normal_world
            lean = np.random.default_rng([self._seed, _STREAM, old.rounds]).uniform(-0.1, 0.1, 3)
            attitude = attitude_at(normal_world, lean[:2], lean[2], bore=False)
            writer.travel(before, attitude, np.nan, 1.0)
            writer.touch("", surface_world, normal_world, tip)
            writer.retract(before)
            kept = old.segments[old.segments[:, kernels.T1] >= not_before_s - 1.0]
            kept = kept if len(kept) else old.segments[-1:]
            segments = np.concatenate([kept, np.array(writer.segments)])
            self._timeline = _Timeline(segments, old.touches, old.rounds + 1)

    def resume(self, tip_world: Float, attitude: Float, at_s: float) -> None:
        """Bring the probe home from its place: up first, so that it clears the part.

        From ``tip_world`` (3,), mm, and ``attitude`` (3,), rad; ``at_s``: after the script.
        """
        with self._lock:
            old = self._timeline
            writer = ScriptWriter(tip_world, at_s, self._dwell_s, attitude)
            above = np.array([tip_world[0], tip_world[1], max(self._safe_z, tip_world[2])])
            writer.travel(above, attitude, np.nan, 0.0)
            writer.travel(self._home, np.zeros(3), np.nan, 0.0)
            writer.rest(REST_S)
            self._timeline = _Timeline(
                np.concatenate([old.segments, np.array(writer.segments)]), old.touches, old.rounds
            )

    def motion(self, times_s: Float) -> Motion:
        """Return the probe at times (n,), s, ascending; a pure function of time."""
        n = len(times_s)
        rotation, tip = np.empty((n, 3, 3)), np.empty((n, 3))
        button, contact = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
        kernels.move(times_s, self._timeline.segments, self._tremor, rotation, tip, button, contact)
        return Motion(rotation, tip, button, contact)

    def _extended(
        self,
        old: _Timeline,
        touches: Touches,
        not_before_s: float,
        taken: Mapping[str, Sequence[Sequence[float]]] | None = None,
    ) -> _Timeline:
        writer = ScriptWriter(self._home, max(old.end_s, not_before_s), self._dwell_s)
        writer.follow(old.segments[-1])
        for index, (name, count) in enumerate(touches):
            if count < 1:
                raise InputError(
                    "simulation.touches",
                    f"Feature '{name}' is set to be touched {count} times.",
                    "Give at least one touch for each feature, or omit the feature.",
                )
            rng = np.random.default_rng([self._seed, _STREAM, old.rounds, index])
            artefact = self._part.artefact(name)
            if name in self._paths:
                length = (count + _SPARE) * self._paths[name]
                if isinstance(artefact, HOLES):
                    # The ball runs inside.
                    width = free_width(artefact)
                    length *= width / (width - 2.0 * self._tip_radius)
                way = slide(artefact, length, self._scans.get(name, ""))
                self._write_path(writer, artefact, way, rng)
                continue
            if taken is not None:
                there = np.array(taken.get(name, ())).reshape(-1, 3)
                contacts = self._open(artefact, count, there, rng)
            elif old.rounds:
                contacts = sample(artefact, max(count, 12), rng)
                contacts = contacts.subset(sorted(rng.permutation(max(count, 12))[:count]))
            else:
                contacts = sample(artefact, count, rng)
            self._places.setdefault(name, contacts)
            self._write_feature(writer, artefact, contacts, rng)
        writer.travel(self._home, np.zeros(3), self._safe_z, 0.0)
        writer.rest(REST_S)
        return _Timeline(
            np.concatenate([old.segments, np.array(writer.segments)]),
            old.touches + tuple(writer.touches),
            old.rounds + 1,
        )

    def _open(
        self, artefact: Artefact, count: int, taken: Float, rng: np.random.Generator
    ) -> Contacts:
        """Return the first `count` touch points of a surface without a point in (n, 3)."""
        places = self._places.get(artefact.name)
        if places is None or len(places.points) < count:
            places = sample(artefact, count + len(taken), rng)
        inverse = self._part.T_world_from_part.inverse()
        return farthest(places, self._tip_radius, inverse.apply(taken), count)

    def _write_feature(
        self, writer: ScriptWriter, artefact: Artefact, contacts: Contacts, rng: np.random.Generator
    ) -> None:
        pose = self._part.T_world_from_part
        surface = pose.apply(contacts.points)
        normals = contacts.normals @ pose.rotation.T
        bore = isinstance(artefact, HOLES)
        approach = _APPROACH_MM
        if isinstance(artefact, HOLES):
            width = free_width(artefact)
            if width <= 2.0 * self._tip_radius:
                raise InputError(
                    "simulation.bore",
                    f"The bore '{artefact.name}' of {width:g} mm is too narrow for a ball of "
                    f"{2.0 * self._tip_radius:g} mm.",
                    "Give a probe with a smaller ball.",
                )
            approach = min(approach, _BORE_APPROACH * (0.5 * width - self._tip_radius))
        if isinstance(artefact, TouchedEntry):
            approach = min(approach, _BORE_APPROACH * (0.5 * artefact.free - self._tip_radius))
        lean = rng.uniform(-0.12, 0.12, 2) * (0.5 if bore else 1.0)
        yaw = rng.uniform(-0.12, 0.12)
        own_z = float(pose.apply(_top(artefact))[0, 2]) + _CLEARANCE_MM + self._tip_radius
        place: int | None = None
        for number in range(len(surface)):
            tip = surface[number] + self._tip_radius * normals[number]
            before = tip + approach * normals[number]
            jitter = rng.uniform(-0.05, 0.05, 3)
            attitude = attitude_at(normals[number], lean + jitter[:2], yaw + jitter[2], bore=bore)
            top = self._safe_z
            if place == contacts.place[number]:
                top = np.nan
            elif place is not None and isinstance(
                artefact, SphereEntry | CylinderEntry | ConeEntry | TorusEntry
            ):
                top = own_z
            place = int(contacts.place[number])
            writer.travel(before, attitude, top, 1.0)
            writer.touch(artefact.name, surface[number], normals[number], tip)
            writer.retract(before)

    def _write_path(
        self, writer: ScriptWriter, artefact: Artefact, contacts: Contacts, rng: np.random.Generator
    ) -> None:
        pose = self._part.T_world_from_part
        normals = contacts.normals @ pose.rotation.T
        tips = pose.apply(contacts.points) + self._tip_radius * normals
        bore = isinstance(artefact, HOLES)
        reach = _APPROACH_MM
        if isinstance(artefact, HOLES):
            reach = min(reach, _BORE_APPROACH * (0.5 * free_width(artefact) - self._tip_radius))
        lean = rng.uniform(-0.1, 0.1, 3)
        attitude = attitude_at(normals[0], lean[:2], lean[2], bore=bore)
        seconds = pace(len(tips), rng.uniform(*_SLIDE_MM_S), rng)
        tips += hops(seconds, rng)[:, None] * normals
        writer.travel(tips[0] + reach * normals[0], attitude, self._safe_z, 1.0)
        writer.slide(artefact.name, tips, normals[0], self._tip_radius, seconds)
        writer.retract(tips[-1] + reach * normals[-1])


def draw_tremor(rng: np.random.Generator, amplitudes: tuple[float, float] = _TREMOR) -> Float:
    """Return waves (2, 3, K, 3) of attitude and place: amplitude, frequency, phase."""
    shape = (2, 3, _TREMOR_WAVES)
    tremor = np.empty((*shape, 3))
    tremor[..., 0] = (np.sqrt(2.0 / _TREMOR_WAVES) * np.array(amplitudes))[:, None, None]
    tremor[..., 1] = 2.0 * np.pi * np.exp(rng.uniform(np.log(0.6), np.log(5.0), shape))
    tremor[..., 2] = rng.uniform(0.0, 2.0 * np.pi, shape)
    return tremor


def _top(artefact: Artefact) -> Float:
    """Return the points (n, 3) of a surface that may be its highest, mm, part frame.

    The axial top point, or all touch points of a surface that lists its own.
    """
    if isinstance(artefact, TouchedEntry):
        return np.array(artefact.places)
    axis = np.array(artefact.direction) / np.linalg.norm(artefact.direction)
    height = 0.0
    if isinstance(artefact, SphereEntry):
        height = 0.5 * artefact.diameter
    elif isinstance(artefact, CylinderEntry | ConeEntry):
        height = artefact.height
    elif isinstance(artefact, TorusEntry):
        height = 0.5 * artefact.tube_diameter
    top: Float = (np.array(artefact.point) + height * axis)[None]
    return top
