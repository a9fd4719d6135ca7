"""The parts of the joint covariance of measured points, by error source.

Each part keeps its natural form, so that its variance of a result is cheap and its matrix is never
formed: quantities common to all points (cameras, probe geometry, ...) with the derivatives of the
points; the scatter of each point's window; the field of the sensors' patterns, shared by near
points. Their sum is `measuring.joint_factors`.

The surface presses the ball towards the probe, along the compensation direction. LEDs and ball move
according to the design of the probe (`calibration.probe_design.ContactForce`); the tip error is
the rest after the pose has followed the LEDs. The force is uniform from zero to the largest: its
mean, a habit of the hand, is common to all points of a job, its scatter independent. Points of
cameras without proof of a common exposure time have a share for the skew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ocmm_core.calibration.probe_design import (
    ContactForce,
    ProbeDesign,
    TemperatureState,
    body_in_use,
    sag_shape,
)
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, RigidTransform, skew
from ocmm_core.measuring._pattern_field import PatternField, pattern_field
from ocmm_core.measuring._point import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.measuring._rows import Rows
from ocmm_core.measuring._stable_point import StablePoint
from ocmm_core.measuring._temperature import PartTemperature, scale_movement
from ocmm_core.tracking import (
    CameraSkew,
    FrameStatus,
    ProbeBody,
    TipSensitivity,
    TrackBlock,
    tip_sensitivity,
)

SWING_MM_S = 20.0
"""Largest speed of an LED while a point is measured: 5 mm in a window, with the ball at rest."""

UNKNOWN_SKEW = (
    "How far apart in time the cameras expose is not known yet.",
    "Hold the probe still before the cameras, then wave it in all directions for some seconds, and "
    "touch again.",
)
"""Reason of a refusal, and its remedy, until the skew has been measured."""


def with_skew(
    point: StablePoint, window: TrackBlock, rig: Rig, body: ProbeBody, skew: CameraSkew
) -> StablePoint | Refusal:
    """Return a point with the uncertainty of the skew, or why it is refused.

    The frames of ``window`` were aligned by the skew. Its uncertainty moves the spots of a camera
    by their mean speed in the window: the ball may rest while the LEDs swing about it.
    """
    if not skew.known:
        return Refusal(RefusalCode.NOT_READY, *UNKNOWN_SKEW, point.time_s)
    inside = (window.counter >= point.first_frame) & (window.counter <= point.last_frame)
    used = np.flatnonzero(inside & (window.status == FrameStatus.OK))
    times = np.asarray(window.time_ns[used] * 1e-9, dtype=np.float64)
    turned = window.rotation_world_from_probe[used] @ body.leds_probe.T
    places = turned.transpose(0, 2, 1) + window.origin_world[used, None]
    swing = float(np.linalg.norm(_slope(times, places), axis=1).max())
    if swing > SWING_MM_S:
        return Refusal(
            RefusalCode.MOVING,
            f"The probe moved at {swing:.1f} mm/s while it was measured, and the cameras do not "
            "expose at the same time.",
            "Hold the probe still, not only its ball, until the tone.",
            point.time_s,
        )
    sensitivity = tip_sensitivity(point.spots, rig, body)
    speed = _slope(times, window.uv[used])[np.isfinite(point.spots).all(axis=2)]
    by_skew = np.zeros((3, len(rig.cameras)))
    np.add.at(by_skew.T, sensitivity.camera, np.einsum("ima,ma->mi", sensitivity.by_spots, speed))
    own = by_skew @ skew.covariance @ by_skew.T
    return replace(point, random_covariance=point.random_covariance + own)


def _slope(times: Float, values: Float) -> Float:
    """Return the slope of values (n, ...) over times (n,) by least squares."""
    about = times - times.mean()
    return np.tensordot(about, values, axes=1) / float(about @ about)


def contact_movement(
    points: Sequence[MeasuredPoint], sensitivities: Sequence[TipSensitivity], contact: ContactForce
) -> Float:
    """Return the error of N ball centres for one newton, (N, 3), mm/N."""
    return np.stack(
        [
            item.by_geometry
            @ (contact.by_force @ (point.rotation_world_from_probe.T @ point.direction))
            for point, item in zip(points, sensitivities, strict=True)
        ]
    )


@dataclass(frozen=True, slots=True)
class ErrorSource:
    """Source of a part of the uncertainty."""

    name: str
    kind: Literal["A", "B"]
    """``"A"``: evaluated from repeated observations of this job; ``"B"``: otherwise."""
    distribution: Literal["normal", "uniform"]
    origin: str
    """Document with its standard uncertainty."""


IMAGE_NOISE = ErrorSource("Image noise", "A", "normal", "scatter in the window of each point")
PATTERN = ErrorSource("Sensor pattern", "B", "normal", "noise of the rig document")
CAMERAS = ErrorSource("Cameras", "B", "normal", "calibration of the cameras")
REFERENCE = ErrorSource("Reference body", "B", "normal", "calibration of the reference body")
PROBE = ErrorSource("Probe geometry", "B", "normal", "calibration of the probe and its tip")
WARMTH = ErrorSource("Probe temperature", "B", "normal", "design of the probe and its temperatures")
WEIGHT = ErrorSource("Probe weight", "B", "uniform", "design of the probe")
FORCE = ErrorSource("Hand force", "B", "uniform", "design of the probe")
TIP_RADIUS = ErrorSource("Tip radius", "B", "normal", "qualification of the tip")
FRAME = ErrorSource("Saved frame", "B", "normal", "document of the frame")
THERMOMETER = ErrorSource("Thermometer", "B", "normal", "certificate of the thermometer")
PART = ErrorSource("Part temperature", "B", "normal", "temperature and expansion of the part")


@dataclass(frozen=True, slots=True)
class Contribution:
    """One part of the joint covariance of N ball centres and the tip radius, mm^2."""

    source: ErrorSource
    by: Float | None = None
    """(3 N + 1, m): derivatives of coordinates and radius by m quantities; None without any."""
    covariance: Float | None = None
    """(m, m) of those quantities."""
    own: Float | None = None
    """(N, 3, 3): independent part of each point; None if zero."""
    field: PatternField | None = None
    """Sensor pattern shared by near points; None if zero."""

    def covariance_of(self, gradients: Rows | Float) -> Float:
        """Return its covariance (k, k) of k values: from rows, or gradients (k, 3 N + 1)."""
        rows = gradients if isinstance(gradients, Rows) else Rows.of_dense(gradients)
        total = np.zeros((len(rows), len(rows)))
        if self.by is not None and self.covariance is not None:
            answers = rows @ self.by
            total += answers @ self.covariance @ answers.T
        if self.own is not None:
            own, of_points = self.own[rows.places], rows.by_points
            total += np.einsum("ani,nij,bnj->ab", of_points, own, of_points, optimize=True)
        if self.field is not None and len(rows.places):
            answers = self.field.kept(rows.places).answers(rows)
            total += answers @ answers.T
        return total


@dataclass(frozen=True, slots=True)
class ProbeState:
    """Inputs that widened the probe document in use, to separate them in a budget."""

    design: ProbeDesign
    temperature_state: TemperatureState


@dataclass(frozen=True, slots=True)
class FrameDoubt:
    """Uncertainty of a frame not measured in this job."""

    T_frame_from_world: RigidTransform
    covariance: Float
    """(6, 6): rotation, rad, about the frame axes through its origin, and shift, mm."""

    def contribution(self, points: Sequence[MeasuredPoint]) -> Contribution:
        """Return its part, a small motion of all points; it cancels without the frame."""
        T = self.T_frame_from_world
        back = T.rotation.T
        places = T.apply(np.array([point.tip_world for point in points]))
        by = [np.hstack([back @ -skew(place), back]) for place in places]
        return Contribution(FRAME, _with_radius(np.vstack(by)), self.covariance)


_LEAST_ON_FACE = 3


@dataclass(frozen=True, slots=True)
class FeatureUncertainty:
    """Uncertainty common to all points of a feature."""

    feature: str
    sigma: float
    """mm, standard."""
    of_gauge: bool = False
    """All move together in any direction, by the play of a gauge in its hole; else each along its
    direction, by the thickness of a sheet."""
    face: str = ""
    engaged: float = 0.0
    """`face`, `engaged`: Plane of the hole, and length of the gauge in it, mm: the play at both of
    its ends tilts the gauge. 0: no tilt."""

    def contribution(self, points: Sequence[MeasuredPoint]) -> Contribution:
        leans = self._leans(points)
        moves = [
            self.sigma * (one.feature == self.feature)
            * (np.kron([[1.0 + lean, -lean]], np.eye(3)) if self.of_gauge
               else one.direction[:, None])
            for one, lean in zip(points, leans, strict=True)
        ]  # fmt: skip
        by = _with_radius(np.concatenate(moves))
        name = f"Play of {self.feature}" if self.of_gauge else f"Sheet of {self.feature}"
        source = ErrorSource(name, "B", "uniform", "limit in the plan")
        return Contribution(source, by, np.eye(by.shape[1]))

    def _leans(self, points: Sequence[MeasuredPoint]) -> list[float]:
        """Return the heights of points above the face, relative to the engaged length."""
        on_face = [one.tip_world for one in points if one.feature == self.face]
        if not self.engaged or len(on_face) < _LEAST_ON_FACE:
            return [0.0] * len(points)
        middle = np.mean(on_face, axis=0)
        normal = np.linalg.svd(np.array(on_face) - middle)[2][-1]
        # Ball centres on the face are a radius above it.
        return [
            (abs(float((one.tip_world - middle) @ normal)) + one.tip_radius) / self.engaged
            for one in points
        ]


def contributions(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    contact: ContactForce | None = None,
    part: PartTemperature | None = None,
    probe: ProbeState | None = None,
    common: Sequence[FrameDoubt | FeatureUncertainty] = (),
) -> tuple[Contribution, ...]:
    """Return all parts of the joint covariance of ``points``.

    Parameters
    ----------
    points
        N points, in any order; without points only the radius is uncertain.
    sensitivities
        `tip_sensitivity` of the spots of each point.
    contact
        Effect of the hand's force; None without a probe design.
    part
        None if not compensated.
    probe
        Separates temperature and weight of the probe from its calibration; without it they are one
        part, with the same sum.
    common
        Uncertainties in the plan: of a saved frame, of sheets and gauges.
    """
    count = len(points)
    radius = np.zeros((3 * count + 1, 1))
    radius[-1] = 1.0
    tip = Contribution(TIP_RADIUS, radius, np.array([[body.tip_radius_sigma**2]]))
    if not points:
        return (tip,)
    noise = Contribution(IMAGE_NOISE, own=np.array([point.random_covariance for point in points]))
    found = [noise, *systematic_contributions(sensitivities, rig, body, probe), tip]
    if contact is not None:
        moved = contact_movement(points, sensitivities, contact)
        square = np.array([[(0.5 * contact.largest_n) ** 2]])
        own = np.einsum("ni,nj->nij", moved, moved) * contact.largest_n**2 / 12.0
        found.append(Contribution(FORCE, _with_radius(moved.reshape(-1, 1)), square, own))
    if part is not None and part.scale_sigma > 0.0:
        moved = scale_movement(points)[:, None]
        found.append(Contribution(PART, moved, np.array([[part.scale_sigma**2]])))
    found = _by_thermometer(found, points, rig, body, part)
    found += [one.contribution(points) for one in common]
    return tuple(found)


def _by_thermometer(
    found: Sequence[Contribution],
    points: Sequence[MeasuredPoint],
    rig: Rig,
    body: ProbeBody,
    part: PartTemperature | None,
) -> list[Contribution]:
    """Return the contributions with the shares of one thermometer added with their signs.

    Cameras, probe and part by one thermometer share its error: a steel part measured by the scale
    of a steel bar does not suffer from it. Shares of a thermometer used once, or of an unknown one,
    stay in their contributions.
    """
    shares = {CAMERAS: rig.thermal, PROBE: body.thermal, WARMTH: body.thermal}
    if part is not None and part.scale_sigma > 0.0 and part.now is not None:
        shares[PART] = part.share
    # The probe's share is within WARMTH if that is named.
    if any(one.source is WARMTH for one in found):
        del shares[PROBE]
    sums: dict[str, Float] = {}
    # In one order in every process: sums round differently in another.
    for name in sorted({one.thermometer for one in shares.values() if one is not None} - {""}):
        mine = [
            (one, share)
            for one in found
            if (share := shares.get(one.source)) is not None and share.thermometer == name
        ]
        if len(mine) < 2:
            continue
        for one, share in mine:
            assert one.by is not None  # noqa: S101 - all three have derivatives
            assert one.covariance is not None  # noqa: S101 - as above
            by_k = share.sigma_k * share.by_k
            sums[name] = sums.get(name, 0.0) + one.by @ by_k
            rest = replace(one, covariance=one.covariance - np.outer(by_k, by_k))
            found = [rest if other is one else other for other in found]
    by_thermometer = [Contribution(THERMOMETER, by[:, None], np.eye(1)) for by in sums.values()]
    return [*found, *by_thermometer]


def systematic_contributions(
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    probe: ProbeState | None = None,
) -> list[Contribution]:
    """Return the parts that averaging over frames does not remove, without tip radius."""
    by_cameras = _with_radius(*(item.by_cameras for item in sensitivities))
    by_geometry = _with_radius(*(item.by_geometry for item in sensitivities))
    by_common = _with_radius(*(item.by_common for item in sensitivities))
    found = [
        Contribution(PATTERN, field=pattern_field(sensitivities, rig)),
        Contribution(CAMERAS, by_cameras, rig.parameter_covariance),
    ]
    found += [
        Contribution(source, by_geometry, covariance)
        for source, covariance in _of_probe(body, probe)
    ]
    if by_common.shape[1]:
        found.append(Contribution(REFERENCE, by_common, np.eye(by_common.shape[1])))
    return found


def _of_probe(body: ProbeBody, probe: ProbeState | None) -> list[tuple[ErrorSource, Float]]:
    """Return the covariance of the probe's geometry, by source."""
    if probe is None:
        return [(PROBE, body.geometry_covariance)]
    bare = replace(body, geometry_covariance=np.zeros_like(body.geometry_covariance))
    hanging = sag_shape(probe.design, body)
    weight = np.outer(hanging, hanging) / 3.0
    temperature_state = (
        body_in_use(bare, probe.design, probe.temperature_state).geometry_covariance - weight
    )
    return [
        (PROBE, body.geometry_covariance - temperature_state - weight),
        (WARMTH, temperature_state),
        (WEIGHT, weight),
    ]


def _with_radius(*by: Float) -> Float:
    return np.concatenate([*by, np.zeros((1, by[0].shape[1]))])
