"""The frame in which a zone stands: where it is, what it leaves open, how the points move it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import (
    MOST_DATUMS,
    AnyAlignment,
    BoundAlignment,
    DatumReferenceFrame,
    datum_frame,
    frame_jacobian,
    frame_name,
    frame_of,
    in_precedence,
    nominal_frame,
    refit_under_precedence,
)
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import POINT, nominal_geometry
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, skew
from ocmm_core.measuring import Rows

BEST_FIT = "best fit"
"""Word for a frame that the toleranced points set alone."""


@dataclass(frozen=True, slots=True)
class ZoneFrame:
    """A frame, and how it answers to the points.

    Attributes
    ----------
    T_frame_from_world
        Where nominal geometry is.
    by_coordinates
        6 rows: turn, rad, over shift, mm, of the frame by every coordinate: a point x of the
        frame moves by ``turn x x + shift``.
    motions
        (6, k): what is open, in the same form.
    words
        Name of the frame for the report.
    """

    T_frame_from_world: RigidTransform
    by_coordinates: Rows
    motions: Float
    words: str

    def moved(self, motion: Float) -> ZoneFrame:
        """Return the frame after an open motion (k,)."""
        twist = self.motions @ motion
        return self.after(RigidTransform(rotation_from_vector(twist[:3]), _shift(twist)))

    def after(self, further: RigidTransform) -> ZoneFrame:
        """Return the frame moved further, by a motion that leaves what is open as it is."""
        return ZoneFrame(
            further.compose(self.T_frame_from_world),
            _transported(further, self.by_coordinates),
            self.motions,
            self.words,
        )

    def point_derivative(self, point_frame: Float, by_coordinates_world: Rows) -> Rows:
        """Return how a point answers in the frame, 3 rows, from how it does in the world."""
        rotation = self.T_frame_from_world.rotation
        by_frame = -skew(point_frame) @ self.by_coordinates[:3] + self.by_coordinates[3:]
        return rotation @ by_coordinates_world + by_frame

    def turning(self) -> ZoneFrame:
        """Return what of the frame acts on directions: no shifts."""
        motions = self.motions.copy()
        motions[3:] = 0.0
        turns = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return ZoneFrame(
            RigidTransform(self.T_frame_from_world.rotation, np.zeros(3)),
            turns @ self.by_coordinates,
            motions[:, np.any(motions != 0.0, axis=0)],
            self.words,
        )

    def with_shifts(self) -> ZoneFrame:
        """Return the frame free to shift in every direction, as zones of orientation are."""
        turning = self.motions[:, np.any(self.motions[:3] != 0.0, axis=0)].copy()
        turning[3:] = 0.0
        shifting = np.vstack([np.zeros((3, 3)), np.eye(3)])
        return ZoneFrame(
            self.T_frame_from_world,
            self.by_coordinates,
            np.hstack([turning, shifting]),
            self.words,
        )


def _shift(twist: Float) -> Float:
    """Return the shift (3,) of a finite motion: the turn about the twist's own axis."""
    turn, shift = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    k = skew(turn)
    if angle < 1e-6:
        return np.asarray(shift + 0.5 * k @ shift, dtype=np.float64)
    a = (1.0 - np.cos(angle)) / angle**2
    b = (angle - np.sin(angle)) / angle**3
    return np.asarray(shift + a * k @ shift + b * k @ k @ shift, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _HeldFrame:
    """The frame of datums, what to know of it, and all geometry, that of datums as it has them."""

    frame: ZoneFrame
    geometries: Mapping[str, Float]
    note: str


class Frames:
    """Frames of datums and of the part, each made once for all characteristics of a job.

    Parameters
    ----------
    actual
        All features as measured: which way an axis runs may rest on any of them.
    alignment
        Rule of the part frame, bound to nominals where its kind needs them.
    """

    def __init__(self, actual: Mapping[str, ActualFeature], alignment: AnyAlignment | None) -> None:
        self._actual = actual
        self._alignment = alignment
        self._geometries = {name: feature.fit.geometry for name, feature in actual.items()}
        self._shapes = {name: feature.fit.shape for name, feature in actual.items()}
        self._nominals = (
            alignment.nominals
            if isinstance(alignment, BoundAlignment)
            else {name: nominal_geometry(item.nominal) for name, item in actual.items()}
        )
        self._held: dict[tuple[str, ...], _HeldFrame] = {}
        self._aligned: ZoneFrame | None = None
        self._aligned_note = ""

    def of_datums(self, datums: Sequence[str], features: Sequence[str]) -> ZoneFrame:
        """Return the frame of up to three datums in their precedence, or of none.

        What the datums leave open is set by the toleranced features, so that the search for the
        smallest zone starts near it.

        Raises
        ------
        FitError
            A datum hardly says how the part lies, or nothing is known of its nominal place.
        """
        if not datums:
            started = self._started((), features, self._geometries)
            points = np.array([self._geometries[name][POINT] for name in features])
            return free_frame(started, points.mean(axis=0))
        key = tuple(datums)
        if key not in self._held:
            self._held[key] = self._of(key)
        held = self._held[key]
        started = self._started(datums, features, held.geometries)
        return held.frame.after(started.compose(held.frame.T_frame_from_world.inverse()))

    def of_part(self, name: str) -> ZoneFrame:
        """Return the frame in which nominals are written, of the plan's alignment.

        Parameters
        ----------
        name
            Of the characteristic that needs it, for errors.

        Raises
        ------
        FitError
            There is no alignment, or its features do not say where the part is.
        """
        if self._alignment is None:
            raise FitError(
                "characteristic.no_frame",
                f"{name} needs datums or a part frame, and the plan has neither.",
                "Name its datums, or add an alignment to the plan.",
            )
        aligned = self.aligned(name)
        if isinstance(self._alignment, BoundAlignment):
            return aligned.after(nominal_frame(self._alignment).inverse())
        return aligned

    def aligned(self, name: str) -> ZoneFrame:
        """Return the part frame itself, as the plan's alignment makes it.

        Parameters
        ----------
        name
            Of the characteristic that needs it, for errors.

        Raises
        ------
        FitError
            As `of_part`.
        """
        rule = self._alignment
        if rule is None:
            raise FitError(
                "characteristic.no_frame",
                f"{name} needs a part frame, and the plan has no alignment.",
                "Add an alignment to the plan.",
            )
        if self._aligned is None:
            words = rule.frame if isinstance(rule, BoundAlignment) else frame_name(rule)
            held = refit_under_precedence(rule, self._actual)
            T_part_from_world = frame_of(rule, held.geometries)
            slopes = frame_jacobian(rule, held.features, T_part_from_world)
            self._aligned = ZoneFrame(T_part_from_world, slopes, np.zeros((6, 0)), words)
            self._aligned_note = held.note
        return self._aligned

    def note_on(self, datums: Sequence[str]) -> str:
        """Return what to know of a frame that was made, of datums or, without any, of the part."""
        if datums:
            held = self._held.get(tuple(datums))
            return "" if held is None else held.note
        return self._aligned_note

    def _of(self, datums: tuple[str, ...]) -> _HeldFrame:
        held, frame = in_precedence(datums, self._actual, self._shapes, self._nominals)
        rule = BoundAlignment(
            DatumReferenceFrame(datums=datums), self._shapes, self._nominals, choice=frame.choice
        )
        slopes = frame_jacobian(rule, held.features, frame.T_frame_from_world)
        zone = ZoneFrame(frame.T_frame_from_world, slopes, frame.free.motions(), "|".join(datums))
        return _HeldFrame(zone, held.geometries, held.note)

    def _started(
        self, datums: Sequence[str], features: Sequence[str], geometries: Mapping[str, Float]
    ) -> RigidTransform:
        """Return the frame of the datums with what they leave open set by the features."""
        least = max(len(datums), 1)
        names = tuple(dict.fromkeys((*datums, *features)))[: max(MOST_DATUMS, least)]
        for count in range(len(names), least, -1):
            try:
                return self._placed(names[:count], geometries)
            except FitError:
                # A further feature that hardly turns the frame leaves it where it is.
                continue
        return self._placed(names[:least], geometries)

    def _placed(self, names: Sequence[str], geometries: Mapping[str, Float]) -> RigidTransform:
        return datum_frame(names, geometries, self._shapes, self._nominals).T_frame_from_world


def free_frame(T_frame_from_world: RigidTransform, middle_world: Float) -> ZoneFrame:
    """Return a frame that nothing holds; its small turns are about a point (3,), mm, world."""
    middle = T_frame_from_world.apply(middle_world)
    motions = np.eye(6)
    motions[3:, :3] = skew(middle)
    return ZoneFrame(T_frame_from_world, Rows.nothing(6), motions, BEST_FIT)


def moved_geometry(
    geometries: Mapping[str, Float], name: str, k: int, step: float
) -> dict[str, Float]:
    """Return the geometries with one number of one of them moved; directions stay unit vectors."""
    moved = geometries[name].copy()
    moved[k] += step
    for part in (slice(3, 6), slice(9, 12)):
        length = float(np.linalg.norm(moved[part]))
        if part.start <= k < part.stop and length > 0.0:
            moved[part] /= length
    return {**geometries, name: moved}


def _transported(further: RigidTransform, twists: Rows) -> Rows:
    """Return small motions, 6 rows, seen after a further motion of the frame."""
    rotation, nothing = further.rotation, np.zeros((3, 3))
    by_twist = np.block([[rotation, nothing], [skew(further.translation) @ rotation, rotation]])
    seen: Rows = by_twist @ twists
    return seen
