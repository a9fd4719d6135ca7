"""Jobs in which one thing is wrong: for `benchmarks.causes` and the tests.

Every job measures a block of its own (`benchmarks.cause_part`): sizes and places off by 4 µm,
surfaces by 1.5 µm, and errors of measuring that are drawn from the covariance which the evaluation
states: cameras, probe, ball, sensors, noise. Then one thing is done to it, with an amount from the
range of its cause. An amount that leaves all results CONFORM is drawn again: nobody asks why then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import msgspec
import numpy as np

from benchmarks.cause_part import (
    DATUMS,
    NOISE_MM,
    T_WORLD_FROM_PART,
    Probed,
    Station,
    block,
    block_plan,
    round_feature,
    station,
    touched,
)
from ocmm_core.alignment import DatumAlignment, SavedFrame
from ocmm_core.features.measured import ActualFeature
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.inspection.causes import EXPLAINED, Cause, Explanation, explanations_of
from ocmm_core.inspection.evaluation import (
    EvaluatedJob,
    FeatureState,
    FeatureView,
    JobView,
    SessionOptions,
    coverage_of,
    evaluated_job,
    whereabouts,
)
from ocmm_core.inspection.plan import Material, Plan
from ocmm_core.measuring import joint_factors
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tracking import tip_sensitivity

PLACES_MM, FORM_MM = 0.004, 0.0015
"""Errors of a good part: sizes and places of features, and its surfaces, 1 sigma."""

OWN = ("RIGHT", "BACK", "STEP", "BORE_A", "BORE_B", "BORE_C", "BORE_D", "BOSS", "PIN", "BALL")
"""Features that are no datum and have more points than they need."""


@dataclass(slots=True)
class Scene:
    """A job with a changing fault; arrays are of all N points, world.

    Attributes
    ----------
    plan, station
        Features and equipment.
    shifts
        (N, 3), mm: offsets of the ball centres.
    flipped
        Names of features whose points are compensated to the wrong side.
    noise
        mm: stated scatter of the points' windows.
    wrong
        Names of features with the fault; empty for a fault of the whole job.
    """

    plan: Plan
    station: Station
    shifts: Float
    flipped: set[str] = field(default_factory=set)
    noise: float = NOISE_MM
    wrong: tuple[str, ...] = ()

    def rows(self, name: str) -> list[int]:
        """Return the places of a feature's points."""
        return [i for i, point in enumerate(self.station.points) if point.feature == name]

    def normals(self, name: str) -> Float:
        """Return the normals out of the material at a feature's points, (n, 3)."""
        return np.array([self.station.points[row].direction for row in self.rows(name)])

    def contacts(self, name: str) -> Float:
        """Return the contact points of a feature, (n, 3), part frame."""
        points = [self.station.points[row] for row in self.rows(name)]
        surface = np.array([point.surface_world for point in points])
        return T_WORLD_FROM_PART.inverse().apply(surface)


Spoil = Callable[[Scene, np.random.Generator], None]


def make_job(seed: int, spoil: Spoil | None) -> tuple[EvaluatedJob, JobView, Scene]:
    """Return a job with one thing wrong, drawn until a result is not CONFORM; or a good one."""
    rng = np.random.default_rng(seed)
    while True:
        features = block()
        scene = Scene(block_plan(features), station(), np.zeros((len(station().points), 3)))
        _make_good(scene, rng)
        if spoil is not None:
            spoil(scene, rng)
        job, view = _measured(scene)
        if spoil is None or any(item.verdict in EXPLAINED for item in view.characteristics):
            return job, view, scene


def asked(view: JobView, found: tuple[Explanation, ...]) -> Explanation | None:
    """Return the first explanation for an inspector: of the value farthest out."""
    tolerance = {item.name: item.upper - item.lower for item in view.characteristics}
    return max(
        found,
        key=lambda item: (
            item.verdict is Verdict.NOT_CONFORM,
            (item.beyond or 0.0) / tolerance[item.characteristic],
        ),
        default=None,
    )


def explained(seed: int, spoil: Spoil | None) -> tuple[tuple[Explanation, ...], JobView, Scene]:
    """Return the explanations of a job with one fault."""
    job, view, scene = make_job(seed, spoil)
    return explanations_of(job, view), view, scene


def _make_good(scene: Scene, rng: np.random.Generator) -> None:
    """Give the part its own small errors, and the measuring its own."""
    for feature in scene.plan.features:
        rows = scene.rows(feature.name)
        normals = scene.normals(feature.name)
        place = rng.normal(0.0, PLACES_MM, 3)
        size = rng.normal(0.0, PLACES_MM) if feature.diameter else 0.0
        off = normals @ place + size + rng.normal(0.0, FORM_MM, len(rows))
        scene.shifts[rows] += off[:, None] * normals
    scene.shifts += _draws()(rng, 1)[0, :-1].reshape(-1, 3)


@cache
def _draws() -> Callable[[np.random.Generator, int], Float]:
    with_all = station()
    factors = joint_factors(
        with_all.points, with_all.sensitivities, with_all.rig, with_all.body, None, None
    )
    return factors.draws()


def _measured(scene: Scene) -> tuple[EvaluatedJob, JobView]:
    place = scene.station
    points = [
        replace(
            point,
            tip_world=point.tip_world + shift,
            random_covariance=scene.noise**2 * np.eye(3),
            direction=-point.direction if point.feature in scene.flipped else point.direction,
        )
        for point, shift in zip(place.points, scene.shifts, strict=True)
    ]
    job = evaluated_job(
        scene.plan, points, place.sensitivities, place.rig, place.body, SessionOptions()
    )
    return job, _view(job)


def _view(job: EvaluatedJob) -> JobView:
    there = whereabouts(job.plan, job.found)
    frame = None if there is None else there.T_nominal_from_world
    features = []
    for nominal in job.plan.features:
        own = tuple(point for point in job.points if point.feature == nominal.name)
        actual = job.found[nominal.name]
        fit = actual.fit if isinstance(actual, ActualFeature) else None
        features.append(
            FeatureView(
                name=nominal.name, shape=nominal.shape, needed=nominal.points,
                state=FeatureState.DONE, points=own, fit=fit, note="",
                coverage=None if fit is None else coverage_of(nominal, fit, own, frame),
            )
        )  # fmt: skip
    return JobView(
        job="causes", part="BLOCK", operator="", features=tuple(features), active="",
        characteristics=job.results_of(job.plan.characteristics), refusal=None, complete=True,
        requirements=None,
    )  # fmt: skip


# Possible faults.


def outlier(scene: Scene, rng: np.random.Generator) -> None:
    """Move one point of a feature without datum by 0.1 to 0.45 mm, in or out."""
    name = str(rng.choice(OWN))
    row = int(rng.integers(len(scene.rows(name))))
    amount = rng.uniform(0.1, 0.45) * rng.choice([-1.0, 1.0])
    scene.shifts[scene.rows(name)[row]] += amount * scene.normals(name)[row]
    scene.wrong = (name,)


def burr(scene: Scene, rng: np.random.Generator) -> None:
    """Raise two or three neighbouring points of a round feature by 0.05 to 0.3 mm."""
    name = str(rng.choice([n for n in OWN if n.startswith("B") and n not in ("BACK", "BALL")]))
    count = int(rng.integers(2, 4))
    ring = len(scene.rows(name)) if name.startswith("BORE") else 6
    first = int(rng.integers(ring))
    height = rng.uniform(0.05, 0.3)
    for step in range(count):
        row = (first + step) % ring
        amount = height * rng.uniform(0.7, 1.0)
        scene.shifts[scene.rows(name)[row]] += amount * scene.normals(name)[row]
    scene.wrong = (name,)


def side(scene: Scene, rng: np.random.Generator) -> None:
    """Take the ball off a face or a point to the wrong side."""
    name = str(rng.choice(["RIGHT", "BACK", "STEP", "CORNER"]))
    scene.flipped.add(name)
    scene.wrong = (name,)


def coverage(scene: Scene, rng: np.random.Generator) -> None:
    """Touch a round feature over 60 to 100 degrees only."""
    index, feature = _round(rng)
    nominal = feature.nominal
    arc = np.radians(rng.uniform(60.0, 100.0))
    n = len(feature.surface)
    turns = rng.uniform(0.0, 2.0 * np.pi) + arc * np.linspace(0.0, 1.0, n)
    heights = np.full(n, -4.0)
    if nominal.shape.value == "Cylinder":
        heights = np.where(np.arange(n) % 2, 1.0, -1.0) * float(
            np.abs(feature.surface[:, 2] - nominal.point[2]).max()
        )
    again = round_feature(
        nominal.name, nominal.shape.value, nominal.point, nominal.diameter, nominal.side, turns,
        heights,
    )  # fmt: skip
    features = list(block())
    features[index] = again
    _touch_again(scene, features, rng)
    scene.wrong = (nominal.name,)


def noise(scene: Scene, rng: np.random.Generator) -> None:
    """Let all points scatter 3 to 5 times more; every second time their windows know it."""
    times = rng.uniform(3.0, 5.0)
    if rng.random() < 0.5:
        scene.noise = times * NOISE_MM
    # Touches scatter as a whole: pattern and noise of the sensors together are about 5 µm.
    scene.shifts += rng.normal(0.0, times * 0.005, scene.shifts.shape)


def tip(scene: Scene, rng: np.random.Generator) -> None:
    """Let the ball be 0.03 to 0.1 mm larger or smaller in radius than it is held for."""
    amount = rng.uniform(0.03, 0.1) * rng.choice([-1.0, 1.0])
    scene.shifts += amount * np.array([point.direction for point in scene.station.points])


def temperature(scene: Scene, rng: np.random.Generator) -> None:
    """Measure a part of steel or aluminium 8 to 25 K off, without compensation."""
    name, ppm = [("steel", 11.5), ("aluminium", 23.8)][int(rng.integers(2))]
    growth = 1e-6 * ppm * rng.uniform(8.0, 25.0) * rng.choice([-1.0, 1.0])
    scene.plan = msgspec.structs.replace(
        scene.plan, material=Material(name=name, expansion_ppm=ppm)
    )
    contacts = np.array([point.surface_world for point in scene.station.points])
    scene.shifts += growth * (contacts - T_WORLD_FROM_PART.translation)


def datum(scene: Scene, rng: np.random.Generator) -> None:
    """Put dirt on a datum: under one point, or so that the whole face lies askew."""
    name = str(rng.choice(DATUMS))
    rows, normals, contacts = scene.rows(name), scene.normals(name), scene.contacts(name)
    scene.wrong = (name,)
    if rng.random() < 0.5:
        row = int(rng.integers(len(rows)))
        scene.shifts[rows[row]] += rng.uniform(0.1, 0.4) * normals[row]
        return
    along = unit(rng.normal(size=3))
    lever = (contacts - contacts.mean(axis=0)) @ along
    lever = (lever - lever.min()) / np.ptp(lever)
    scene.shifts[rows] += (rng.uniform(0.1, 0.4) * lever)[:, None] * normals


def alignment(scene: Scene, rng: np.random.Generator) -> None:
    """Take over a frame from before the part was moved, or put its origin at the wrong bore."""
    if rng.random() < 0.5:
        turn = rotation_from_vector(rng.uniform(-1e-3, 1e-3, 3))
        moved = RigidTransform(turn, unit(rng.normal(size=3)) * rng.uniform(0.1, 0.5))
        T = moved.compose(T_WORLD_FROM_PART.inverse())
        known = tuple(tuple(float(v) for v in row) for row in np.diag([1e-10] * 3 + [1e-5] * 3))
        rule = SavedFrame(
            name="FIXTURE", digest="0" * 64, translation=tuple(T.translation.tolist()),
            rotation=tuple(tuple(row) for row in T.rotation.tolist()), covariance=known,  # type: ignore[arg-type]  # three rows of three
        )  # fmt: skip
        scene.plan = msgspec.structs.replace(scene.plan, alignment=rule)
        return
    origin = str(rng.choice(["BORE_B", "BORE_C", "BORE_D"]))
    rule_ = DatumAlignment(primary="TOP", secondary=("BORE_A", "BORE_B"), origin=origin)
    items = [
        msgspec.structs.replace(item, nominal=_from_bore_a(item.features[0], item.axis, scene.plan))
        if item.kind == "coordinate" else item
        for item in scene.plan.characteristics
    ]  # fmt: skip
    scene.plan = msgspec.structs.replace(scene.plan, alignment=rule_, characteristics=items)


def part(scene: Scene, rng: np.random.Generator) -> None:
    """Make one feature too large or small, out of place or out of round, by 0.1 to 0.4 mm."""
    amount = rng.uniform(0.1, 0.4) * rng.choice([-1.0, 1.0])
    kind = int(rng.integers(3))
    name = str(rng.choice(OWN if kind == 1 else [n for n in OWN if n not in _FACES]))
    rows, normals = scene.rows(name), scene.normals(name)
    scene.wrong = (name,)
    if kind == 0:
        off = np.full(len(rows), amount)
    elif kind == 1:
        shift = unit(np.array([*rng.normal(size=2), 0.0]))
        way = normals[0] if name in _FACES else T_WORLD_FROM_PART.rotation @ shift
        off = amount * normals @ way
    else:
        turned = normals @ T_WORLD_FROM_PART.rotation
        angle = np.arctan2(turned[:, 1], turned[:, 0])
        off = abs(amount) * 0.5 * np.cos(2.0 * angle + rng.uniform(0.0, 2.0 * np.pi))
    scene.shifts[rows] += off[:, None] * normals


_FACES = ("RIGHT", "BACK", "STEP")

SPOILED: dict[str, tuple[Spoil, tuple[Cause, ...]]] = {
    "outlier": (outlier, (Cause.OUTLIER,)),
    "burr": (burr, (Cause.BURR,)),
    "side": (side, (Cause.SIDE,)),
    "coverage": (coverage, (Cause.COVERAGE,)),
    "noise": (noise, (Cause.NOISE,)),
    "tip": (tip, (Cause.TIP,)),
    "temperature": (temperature, (Cause.TEMPERATURE,)),
    "datum": (datum, (Cause.DATUM,)),
    "alignment": (alignment, (Cause.ALIGNMENT,)),
    "part": (part, (Cause.PART,)),
}
"""The change of a job, by its word, and its correct causes."""


def is_right(word: str, found: Explanation | None, scene: Scene) -> bool:
    """Return whether the cause and its place are named."""
    if found is None or found.cause not in SPOILED[word][1]:
        return False
    return not scene.wrong or bool(set(scene.wrong) & set(found.finding.features))


def _round(rng: np.random.Generator) -> tuple[int, Probed]:
    features = block()
    names = [item.nominal.name for item in features]
    name = str(rng.choice(["BORE_A", "BORE_B", "BORE_C", "BORE_D", "BOSS", "PIN"]))
    return names.index(name), features[names.index(name)]


def _touch_again(scene: Scene, features: list[Probed], rng: np.random.Generator) -> None:
    """Touch features at other places; errors of measuring stay, those of the part are new."""
    old = scene.station
    points = touched(features, old.body, old.rig)
    sensitivities = tuple(
        old.sensitivities[i]
        if np.array_equal(points[i].tip_world, old.points[i].tip_world)
        else tip_sensitivity(points[i].spots, old.rig, old.body)
        for i in range(len(points))
    )
    scene.station = Station(old.rig, old.body, points, sensitivities)
    scene.shifts = np.zeros_like(scene.shifts)
    _make_good(scene, rng)


def _from_bore_a(name: str, axis: str, plan: Plan) -> float:
    """Return the nominal coordinate relative to bore A, the origin of the drawing."""
    place, origin = plan.feature(name).point, plan.feature("BORE_A").point
    index = "xyz".index(axis)
    # The origin lies in the top face.
    return place[index] - (40.0 if axis == "z" else origin[index])
