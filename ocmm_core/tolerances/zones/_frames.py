"""Cached frames of datums and of the part, and derived elements: centres, axes and sections.

Minimum zones and bounding elements of ball centres are cached likewise: a search takes 0.1 s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

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
from ocmm_core.features.elements import fit_circle_projected
from ocmm_core.features.measured import ActualFeature, Each, Instead, geometries_of
from ocmm_core.features.shapes import Criterion, Fit, Shape, nominal_geometry, shapes_where
from ocmm_core.features.zones import fit_bounded, fit_zone
from ocmm_core.geometry import Float, Int, Points3, RigidTransform
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones._surface import own_fit
from ocmm_core.tolerances.zones._zone_frame import ZoneFrame, free_frame
from ocmm_core.tolerances.zones._zones import DerivedPoint

_KEPT = 100
"""Cache size: more than a job has characteristics of form."""


def associated(start: Fit, points: Points3, criterion: Criterion, offset: float = 0.0) -> Fit:
    """Return the element of points (n, 3), mm, by a criterion other than least squares.

    ``start`` is their least-squares fit; ``offset``, mm, the distance of the points outside an
    ellipse, for its minimum zone. FitError as `features.zones.fit_zone` and `fit_bounded`.
    """
    return _searched(_Search(start, points, criterion, offset))


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Cache key of a search; equal if all numbers are."""

    start: Fit
    points: Points3
    criterion: Criterion
    offset: float

    def _key(self) -> tuple[str, str, bytes, bytes, float]:
        return (
            self.criterion.value,
            self.start.shape.value,
            self.start.geometry.tobytes(),
            self.points.tobytes(),
            self.offset,
        )

    def __hash__(self) -> int:
        return hash(self._key())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Search) and self._key() == other._key()


@lru_cache(maxsize=_KEPT)
def _searched(search: _Search) -> Fit:
    if search.criterion is Criterion.MINIMUM_ZONE:
        return fit_zone(search.start, search.points, search.offset)
    return fit_bounded(search.start, search.points, search.criterion)


def no_part_frame(name: str, remedy: str = "Add an alignment to the plan.") -> FitError:
    """Return the error of a characteristic that lacks a part frame."""
    return FitError(
        "characteristic.no_frame",
        f"{name} needs a part frame, and the plan has no alignment.",
        remedy,
    )


@dataclass(frozen=True, slots=True)
class HeldFrame:
    """Frame of datums or of the part, with its associated datums and a note."""

    frame: ZoneFrame
    datums: Mapping[str, ActualFeature]
    note: str

    def geometries(self, actual: Mapping[str, ActualFeature]) -> Mapping[str, Float]:
        """Return all geometry, with the datums as associated in the frame."""
        return geometries_of(Instead(self.datums, actual))


class Keep(Protocol):
    """Cache of frames, by the names of their datums; no names for the part."""

    def __call__(
        self,
        datums: tuple[str, ...],
        actual: Mapping[str, ActualFeature],
        make: Callable[[Mapping[str, ActualFeature]], HeldFrame],
    ) -> HeldFrame: ...


class Frames:
    """Frames of datums and of the part, shared by all characteristics of a job.

    Pass all features, as any may determine the sense of an axis. ``alignment`` is bound to nominals
    if its kind needs them; ``keep`` caches across feature sets, by default not.
    """

    def __init__(
        self,
        actual: Mapping[str, ActualFeature],
        alignment: AnyAlignment | None,
        keep: Keep | None = None,
    ) -> None:
        self._actual = actual
        self._alignment = alignment
        self._keep = keep or _made
        self._held: dict[tuple[str, ...], HeldFrame] = {}

    def of_datums(self, datums: Sequence[str], features: Sequence[str]) -> ZoneFrame:
        """Return the frame of up to three datums in their precedence, or of none.

        Freedom left by the datums is set by the toleranced features, so that the search for the
        smallest zone starts near it. FitError: undetermined, or unknown nominal place.
        """
        if not datums:
            started = self._started((), features, geometries_of(self._actual))
            points = np.array([self._actual[name].fit.point for name in features])
            return free_frame(started, points.mean(axis=0))
        key = tuple(datums)
        held = self._known(key, lambda actual: _frame_of_datums(key, actual, self._alignment))
        started = self._started(datums, features, held.geometries(self._actual))
        return held.frame.after(started.compose(held.frame.T_frame_from_world.inverse()))

    def of_part(self, name: str) -> ZoneFrame:
        """Return the frame of the nominals; ``name`` is for errors; FitError: undetermined."""
        if self._alignment is None:
            raise no_part_frame(name, "Name its datums, or add an alignment to the plan.")
        aligned = self.aligned(name)
        if isinstance(self._alignment, BoundAlignment):
            return aligned.after(nominal_frame(self._alignment).inverse())
        return aligned

    def aligned(self, name: str) -> ZoneFrame:
        """Return the part frame of the plan's alignment; errors as `of_part`."""
        rule = self._alignment
        if rule is None:
            raise no_part_frame(name)
        return self._known((), lambda actual: _frame_of_part(rule, actual)).frame

    def note_on(self, datums: Sequence[str]) -> str:
        """Return the note on a computed frame of datums or, without any, of the part."""
        held = self._held.get(tuple(datums))
        return "" if held is None else held.note

    def _known(
        self, datums: tuple[str, ...], make: Callable[[Mapping[str, ActualFeature]], HeldFrame]
    ) -> HeldFrame:
        """Return the frame of datums or, without any, of the part; cached."""
        if datums not in self._held:
            self._held[datums] = self._keep(datums, self._actual, make)
        return self._held[datums]

    def _started(
        self, datums: Sequence[str], features: Sequence[str], geometries: Mapping[str, Float]
    ) -> RigidTransform:
        """Return the frame of the datums, with remaining freedom set by the features."""
        least = max(len(datums), 1)
        names = tuple(dict.fromkeys((*datums, *features)))[: max(MOST_DATUMS, least)]
        for count in range(len(names), least, -1):
            try:
                return self._placed(names[:count], geometries)
            except FitError:
                # A further feature that poorly determines the rotation is ignored.
                continue
        return self._placed(names[:least], geometries)

    def _placed(self, names: Sequence[str], geometries: Mapping[str, Float]) -> RigidTransform:
        shapes, nominals = _said(self._actual, self._alignment)
        return datum_frame(names, geometries, shapes, nominals).T_frame_from_world


def _made(
    datums: tuple[str, ...],
    actual: Mapping[str, ActualFeature],
    make: Callable[[Mapping[str, ActualFeature]], HeldFrame],
) -> HeldFrame:
    return make(actual)


def _said(
    actual: Mapping[str, ActualFeature], alignment: AnyAlignment | None
) -> tuple[Mapping[str, Shape], Mapping[str, Float]]:
    """Return shapes and nominal geometry of features."""
    shapes = Each(actual, lambda feature: feature.fit.shape)
    if isinstance(alignment, BoundAlignment):
        return shapes, alignment.nominals
    return shapes, Each(actual, lambda feature: nominal_geometry(feature.nominal))


def _frame_of_datums(
    datums: tuple[str, ...], actual: Mapping[str, ActualFeature], alignment: AnyAlignment | None
) -> HeldFrame:
    shapes, nominals = _said(actual, alignment)
    held, frame = in_precedence(datums, actual, shapes, nominals)
    rule = BoundAlignment(DatumReferenceFrame(datums=datums), shapes, nominals, choice=frame.choice)
    slopes = frame_jacobian(rule, held.features, frame.T_frame_from_world)
    zone = ZoneFrame(frame.T_frame_from_world, slopes, frame.free.motions(), "|".join(datums))
    return HeldFrame(zone, {name: held.features[name] for name in datums}, held.note)


def _frame_of_part(rule: AnyAlignment, actual: Mapping[str, ActualFeature]) -> HeldFrame:
    words = rule.frame if isinstance(rule, BoundAlignment) else frame_name(rule)
    held = refit_under_precedence(rule, actual)
    T_part_from_world = frame_of(rule, held.geometries, held.features)
    slopes = frame_jacobian(rule, held.features, T_part_from_world)
    zone = ZoneFrame(T_part_from_world, slopes, np.zeros((6, 0)), words)
    return HeldFrame(zone, {}, held.note)


AXES = shapes_where(lambda spec: spec.is_long)
"""Shapes with an axis, or axes themselves."""

CENTRES = shapes_where(lambda spec: spec.centred)

SECTION_POINTS = 4
"""Minimum number of points of a section; `SECTION_RECOMMENDED` are recommended."""
SECTION_RECOMMENDED = 8

_GAP = 0.15
"""Part of the whole length between neighbouring points that separates two sections, and..."""
_GAP_MM = 2.0
"""... the least such gap: accuracy of manual probing at one height."""
_THICKEST = 0.35
"""Largest part of the whole length within one of several sections."""


def derived_points(feature: ActualFeature, length: float = 0.0) -> tuple[DerivedPoint, ...]:
    """Return centre or ends of axis, ``length`` mm long (0: as probed); FitError: no length."""
    geometry, jacobian = feature.fit.geometry, feature.jacobian
    if not feature.fit.shape.spec.is_long:
        return (DerivedPoint(geometry[0:3], jacobian[0:3]),)
    low, high = _extent(feature)
    if length > 0.0:
        middle = 0.5 * (low + high)
        low, high = middle - 0.5 * length, middle + 0.5 * length
    if high - low <= 0.0:
        raise FitError(
            "characteristic.no_length",
            f"The axis of {feature.nominal.name} has no length.",
            "Give the characteristic a 'length', or probe the feature at two heights.",
        )
    return tuple(
        DerivedPoint(geometry[0:3] + t * geometry[3:6], jacobian[0:3] + t * jacobian[3:6])
        for t in (low, high)
    )


def _extent(feature: ActualFeature) -> tuple[float, float]:
    """Return the extent of a feature along its axis, mm from its point."""
    if feature.touches is None:
        half = 0.5 * feature.nominal.length
        return -half, half
    along = (feature.touches.tips - feature.fit.point) @ feature.fit.direction
    return float(along.min()), float(along.max())


@dataclass(frozen=True, slots=True)
class Section:
    """Points of a surface of revolution in one plane across an axis, or at one radius."""

    rows: Int
    at: float
    """mm: position."""


def sections(name: str, places: Float) -> tuple[Section, ...]:
    """Return sections by heights or radii (n,), mm; FitError: no sections, or too few points."""
    order = np.argsort(places, kind="stable")
    whole = float(np.ptp(places))
    gaps = np.diff(places[order])
    breaks = np.flatnonzero(gaps > max(_GAP_MM, _GAP * whole)) + 1
    found = [Section(rows, float(places[rows].mean())) for rows in np.split(order, breaks)]
    for section in found:
        scattered = float(np.ptp(places[section.rows]))
        if scattered > max(_GAP_MM, _THICKEST * whole) and whole > 2.0 * _GAP_MM:
            raise FitError(
                "characteristic.no_sections",
                f"The points of {name} are not in sections: {len(section.rows)} of them spread "
                f"over {scattered:.1f} mm.",
                f"Take at least {SECTION_RECOMMENDED} points around one section, then the next.",
            )
        if len(section.rows) < SECTION_POINTS:
            raise FitError(
                "characteristic.short_section",
                f"A section of {name} needs at least {SECTION_POINTS} points ({len(section.rows)} "
                "taken).",
                f"Take {SECTION_RECOMMENDED} points in every section.",
            )
    return tuple(found)


def few_in_a_section(found: tuple[Section, ...]) -> str:
    """Return a note if a section has fewer points than recommended."""
    least = min(len(section.rows) for section in found)
    if least >= SECTION_RECOMMENDED:
        return ""
    return f"Few points: a section has {least} of {SECTION_RECOMMENDED} recommended."


def axis_sections(feature: ActualFeature) -> tuple[Section, ...]:
    """Return the sections across the axis of a feature; FitError as `sections`."""
    touches, raw = own_fit(feature)
    return sections(feature.nominal.name, (touches.tips - raw.point) @ raw.direction)


def section_circle(feature: ActualFeature, section: Section) -> tuple[Fit, Rows]:
    """Return the least-squares circle of a section's centres, with its jacobian, 12 rows.

    The axis direction counts as constant: its tilt of the section is of second order.
    """
    touches, raw = own_fit(feature)
    fit, _ = fit_circle_projected(touches.tips[section.rows], raw.direction)
    return fit, Rows.of_points(np.asarray(touches.places)[section.rows], fit.jacobian)


def median_line(feature: ActualFeature) -> tuple[DerivedPoint, ...]:
    """Return the centres of all sections (extracted axis); FitError for fewer than three."""
    found = axis_sections(feature)
    if len(found) < 3:
        raise FitError(
            "characteristic.no_axis",
            f"{feature.nominal.name} was probed in {len(found)} section(s); straightness of an "
            "axis needs at least three.",
            "Probe around at three heights or more.",
        )
    centres = [section_circle(feature, section) for section in found]
    return tuple(DerivedPoint(fit.point, by_all[0:3]) for fit, by_all in centres)
