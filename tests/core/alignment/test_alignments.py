"""Alignments of every kind: against independent solutions, and their refusals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ocmm_core.alignment import (
    Alignment,
    BestFit,
    BoundAlignment,
    DatumAlignment,
    DatumReferenceFrame,
    LockedMotion,
    Relocation,
    SavedFrame,
    alignment_fault,
    fit_points,
    fit_points_locked,
    frame_document,
    frame_name,
    frame_of,
    load_frame,
    relocation,
    save_frame,
    saved_frame,
    settled,
)
from ocmm_core.alignment._rules import Condition, PlaneAxisPoint, ReferencePoints
from ocmm_core.errors import FitError, InputError, StorageError
from ocmm_core.features.shapes import DIRECTION, POINT
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, skew
from tests.core.alignment.parts import NOMINALS, SHAPES, anywhere, measured

pytestmark = pytest.mark.numerics

MOTIONS: tuple[LockedMotion, ...] = ("rx", "ry", "rz", "x", "y", "z")
DATUMS = DatumReferenceFrame(datums=("A", "H", "G"))
BEST = BestFit(points=("H", "G", "S", "P"))
SIX = ReferencePoints(
    conditions=(
        Condition(feature="H", direction=(0.0, 0.0, 1.0)),
        Condition(feature="G", direction=(0.0, 0.0, 1.0)),
        Condition(feature="S", direction=(0.0, 0.0, 1.0)),
        Condition(feature="H", direction=(0.0, 1.0, 0.0)),
        Condition(feature="G", direction=(0.0, 1.0, 0.0)),
        Condition(feature="P", direction=(1.0, 0.0, 0.0)),
    )
)
NOMINAL_RULES: dict[str, Alignment] = {
    "plane, standing axis, point": PlaneAxisPoint(plane="A", axis="Z", point="G"),
    "plane, lying axis, point": PlaneAxisPoint(plane="A", axis="X", point="S"),
    "datums": DatumReferenceFrame(datums=("S", "A", "X")),
    "best fit": BEST,
    "locked": BestFit(points=("H", "G", "S"), locked=("rx", "ry", "z"), start=DATUMS),
    # The frame of this start is not that of the nominals: its origin is H.
    "locked after 3-2-1": BestFit(
        points=("H", "G", "S"),
        locked=("x", "y", "rz"),
        start=DatumAlignment(primary="A", secondary=("H", "G"), origin="H"),
    ),
    "rps": SIX,
    "rps after datums": ReferencePoints(conditions=SIX.conditions, start=DATUMS),
}


def bound(rule: Alignment) -> BoundAlignment:
    return BoundAlignment(rule, SHAPES, NOMINALS)


def _off(first: RigidTransform, second: RigidTransform) -> float:
    return float(
        np.abs(first.rotation - second.rotation).max()
        + np.abs(first.translation - second.translation).max()
    )


@pytest.mark.parametrize("name", list(NOMINAL_RULES))
@pytest.mark.parametrize("seed", range(3))
def test_every_kind_finds_the_frame_of_the_nominals(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    T_world_from_part = anywhere(rng)
    geometries = measured(T_world_from_part, rng)
    T_part_from_world = frame_of(bound(NOMINAL_RULES[name]), geometries)
    assert _off(T_part_from_world, T_world_from_part.inverse()) < 1e-8


@pytest.mark.parametrize(
    ("rule", "origin"),
    [
        (DatumAlignment(primary="A", secondary=("H", "G"), origin="H"), None),
        (DatumAlignment(primary="A", secondary=("X",), origin="P"), (60.0, 15.0, 0.0)),
        (DatumAlignment(primary="A", secondary=("B",), origin="P"), (0.0, 15.0, 0.0)),
        (DatumAlignment(primary="Z", secondary=("B",), origin="P"), (30.0, 30.0, 7.0)),
        (DatumAlignment(primary="A", secondary=("X",), origin="P", towards="S"), (60.0, 15.0, 0.0)),
        (
            DatumAlignment(
                primary="C", secondary=("A",), origin="S", primary_axis="-y", secondary_axis="z"
            ),
            (10.0, 0.0, 0.0),
        ),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_three_two_one_of_other_features(
    rule: DatumAlignment, origin: tuple[float, float, float] | None, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    T_world_from_part = anywhere(rng)
    geometries = measured(T_world_from_part, rng)
    T = frame_of(settled(bound(rule), geometries), geometries)
    axes = T.rotation @ T_world_from_part.rotation
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-12)
    along = {"H": np.array([60.0, 20.0, 0.0]) / np.sqrt(4000.0)}
    way = along.get(rule.secondary[0], NOMINALS[rule.secondary[0]][DIRECTION])
    for axis, direction in (
        (rule.primary_axis, NOMINALS[rule.primary][DIRECTION]),
        (rule.secondary_axis, way),
    ):
        wanted = np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0)
        assert axes @ direction == pytest.approx(wanted, abs=1e-11)
    if origin is not None:
        at = T.apply(T_world_from_part.apply(np.array(origin)))
        assert at == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_an_axis_whose_sense_nothing_tells_is_refused() -> None:
    geometries = measured(RigidTransform.identity(), np.random.default_rng(0))
    rule = DatumAlignment(primary="A", secondary=("X",), origin="P")
    known = {name: NOMINALS[name] for name in ("A", "X")}
    with pytest.raises(FitError, match="The direction of the axes along A, X, P is undefined"):
        frame_of(BoundAlignment(rule, SHAPES, known), geometries)
    with pytest.raises(FitError, match="Z is nearly parallel to A"):
        frame_of(bound(DatumAlignment(primary="A", secondary=("Z",), origin="P")), geometries)


def _noisy(
    rng: np.random.Generator, n: int, start_error: float
) -> tuple[Float, Float, Float, RigidTransform]:
    """Return measured and wanted points, weights, and a first frame that is not quite right."""
    wanted = rng.normal(size=(n, 3)) * [100.0, 80.0, 30.0] + [500.0, 200.0, 0.0]
    start = anywhere(rng)
    turn = rotation_from_vector(start_error * rng.normal(size=3))
    error = RigidTransform(turn, 50.0 * start_error * rng.normal(size=3))
    points = start.inverse().compose(error).apply(wanted) + 0.1 * rng.normal(size=wanted.shape)
    return points, wanted, rng.uniform(0.5, 2.0, n), start


@pytest.mark.parametrize("seed", range(4))
def test_best_fit_is_that_of_scipy(seed: int) -> None:
    points, wanted, weights, _ = _noisy(np.random.default_rng(seed), 25, 0.0)
    mine = fit_points(points, wanted, weights)
    a, b = (np.average(items, axis=0, weights=weights) for items in (points, wanted))
    rotation, _ = Rotation.align_vectors(wanted - b, points - a, weights=weights)
    assert np.abs(mine.rotation - rotation.as_matrix()).max() < 1e-12
    assert np.abs(mine.apply(a) - b).max() < 1e-9


def test_where_nothing_is_locked_the_start_does_not_matter() -> None:
    points, wanted, weights, start = _noisy(np.random.default_rng(4), 15, 0.05)
    mine = fit_points_locked(points, wanted, weights, start, ())
    best = fit_points(points, wanted, weights)
    assert np.abs(mine.rotation - best.rotation).max() == 0.0
    assert np.abs(mine.translation - best.translation).max() == 0.0


LOCKS = [locked for count in (1, 2, 3, 5) for locked in combinations(MOTIONS, count)][::4]


@pytest.mark.parametrize("locked", LOCKS, ids="+".join)
def test_locked_motions_stay_and_the_rest_is_the_best(locked: Sequence[LockedMotion]) -> None:
    points, wanted, weights, start = _noisy(np.random.default_rng(len(locked)), 15, 0.05)
    mine = fit_points_locked(points, wanted, weights, start, locked)
    change = mine.compose(start.inverse())
    motion = np.concatenate([Rotation.from_matrix(change.rotation).as_rotvec(), change.translation])
    for name in locked:
        assert abs(motion[MOTIONS.index(name)]) < 1e-11
    free = [index for index, name in enumerate(MOTIONS) if name not in locked]
    before, root = start.apply(points), np.sqrt(weights)[:, None]

    def residuals(x: Float) -> Float:
        # The exponential takes complex steps, so that the reference has exact derivatives.
        full = np.zeros(6, dtype=x.dtype)
        full[free] = x
        cross = np.zeros((3, 3), dtype=x.dtype)
        for axis, base in zip(full[:3], np.eye(3), strict=True):
            cross = cross + axis * skew(base)
        turned = before @ scipy.linalg.expm(cross).T
        return (root * (turned + full[3:] - wanted)).ravel()

    best = least_squares(residuals, np.zeros(len(free)), jac="cs", x_scale="jac").x
    for _ in range(60):
        # The search ends when the cost no longer changes, 1e-7 mm before the optimum.
        columns = [residuals(best + 1e-30j * step).imag / 1e-30 for step in np.eye(len(free))]
        best = best - np.linalg.lstsq(np.stack(columns, axis=1), residuals(best))[0]
    full = np.zeros(6)
    full[free] = best
    placed = RigidTransform(Rotation.from_rotvec(full[:3]).as_matrix(), full[3:]).apply(before)
    assert np.abs(change.apply(before) - placed).max() < 1e-9


def test_points_that_leave_a_motion_open_are_refused() -> None:
    line = np.outer(np.linspace(300.0, 390.0, 5), [1.0, 0.0, 0.0])
    with pytest.raises(FitError, match=r"lie within 0\.0 mm of one line"):
        fit_points(line, line, np.ones(5))
    far = RigidTransform.identity()
    with pytest.raises(FitError, match="do not constrain the motion rx"):
        fit_points_locked(line, line, np.ones(5), far, ("x",))
    # With the turn about their line locked, the same points suffice.
    assert _off(fit_points_locked(line, line, np.ones(5), far, ("rx",)), far) < 1e-12
    # Two points far from the origin of the frame hold a turn about it that is locked in place.
    assert _off(fit_points_locked(line[:2], line[:2], np.ones(2), far, ("rx", "ry")), far) < 1e-12


def test_rps_is_three_two_one_in_closed_form() -> None:
    """Three heights, two y and one x: the plane of the three, the line of the two, the one."""
    rng = np.random.default_rng(6)
    geometries = measured(anywhere(rng), rng)
    for name in ("H", "G", "S", "P"):
        geometries[name][POINT] += 0.3 * rng.normal(size=3)
    T = frame_of(bound(SIX), geometries)
    for item in SIX.conditions:
        off = T.apply(geometries[item.feature][POINT]) - NOMINALS[item.feature][POINT]
        assert off @ np.array(item.direction) == pytest.approx(0.0, abs=1e-9)
    # Closed form: the plane through the three places of the part that have the given heights.
    world = np.array([geometries[name][POINT] for name in ("H", "G", "S")])
    heights = np.array([NOMINALS[name][POINT][2] for name in ("H", "G", "S")])
    arms, rises = world[1:] - world[0], heights[1:] - heights[0]
    normal = np.cross(arms[0], arms[1])
    least = np.linalg.lstsq(arms, rises)[0]
    candidates = [
        least + side * np.sqrt(1.0 - least @ least) * normal / np.linalg.norm(normal)
        for side in (1.0, -1.0)
    ]
    assert min(np.abs(T.rotation[2] - z).max() for z in candidates) < 1e-10


def test_six_conditions_that_leave_the_part_open_are_refused() -> None:
    geometries = measured(RigidTransform.identity(), np.random.default_rng(0))
    flat = [Condition(feature=name, direction=(0.0, 0.0, 1.0)) for name in "HGSP"]
    flat += [Condition(feature=name, direction=(0.0, 1.0, 0.0)) for name in "HG"]
    with pytest.raises(FitError, match="do not constrain the part: translation along x"):
        frame_of(bound(ReferencePoints(conditions=tuple(flat))), geometries)


def test_a_part_is_found_again_at_its_control_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    before = anywhere(rng)
    geometries = measured(before, rng)
    control = {name: geometries[name][POINT] for name in ("H", "G", "S", "P")}
    document = frame_document(
        "fixture", "2026-01-02T03:04:05+01:00", 'part 7 "x"', before.inverse(), control
    )
    path = tmp_path / "fixture.toml"
    save_frame(path, document)
    assert load_frame(path) == document
    assert saved_frame(document).digest == document.sha256
    assert _off(frame_of(saved_frame(document), {}), before.inverse()) == 0.0

    after = anywhere(rng)
    again = measured(after, rng)
    rule = relocation(load_frame(path), limit=0.05)
    assert _off(frame_of(rule, again), after.inverse()) < 1e-9
    again["G"][POINT] += after.rotation @ np.array([0.0, 0.0, 0.2])
    with pytest.raises(FitError, match=r"G is 0\.\d+ mm off; the limit is 0\.050 mm"):
        frame_of(rule, again)
    del again["G"]
    with pytest.raises(FitError, match="needs G, which is not measured"):
        frame_of(rule, again)


def test_a_frame_that_was_changed_or_exists_is_refused(tmp_path: Path) -> None:
    document = frame_document("m", "2026-01-02", "bed", RigidTransform.identity(), {})
    path = tmp_path / "m.toml"
    save_frame(path, document)
    with pytest.raises(StorageError, match="this file already exists"):
        save_frame(path, document)
    path.write_text(path.read_text().replace("translation = [0.0,", "translation = [0.1,"))
    with pytest.raises(InputError, match="does not match its hash"):
        load_frame(path)
    with pytest.raises(InputError, match=r"has 0 control point\(s\)"):
        relocation(document, 0.1)


def test_a_start_is_looked_at_and_may_be_left_out() -> None:
    wrong = PlaneAxisPoint(plane="H", axis="X", point="S")
    points = ("H", "G", "S")
    for left_out, begun in (
        (SIX, ReferencePoints(conditions=SIX.conditions, start=wrong)),
        (BestFit(points=points), BestFit(points=points, start=wrong)),
    ):
        assert alignment_fault(left_out, SHAPES) is None
        fault = alignment_fault(begun, SHAPES)
        assert fault is not None
        assert fault[0] == "alignment.start.plane"


def test_a_report_names_the_frame() -> None:
    assert frame_name(BestFit(points=("H", "G", "S"))) == "part frame, best fit of 3 points"
    assert frame_name(SIX) == "part frame of 4 reference points (RPS)"
    assert frame_name(DatumAlignment(primary="A", secondary=("X", "S"), origin="S")) == (
        "part frame 3-2-1 of A|X to S|S"
    )
    assert frame_name(PlaneAxisPoint(plane="A", axis="X", point="S")) == "part frame of A|X|S"


def test_a_saved_frame_is_a_rotation_and_may_have_a_covariance() -> None:
    turned = Rotation.from_rotvec([0.3, -0.2, 1.1]).as_matrix()

    def fault_of(rotation: Float) -> object:
        (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
        rule = SavedFrame(
            name="m",
            digest="",
            rotation=((a, b, c), (d, e, f), (g, h, i)),
            translation=(1.0, 2.0, 3.0),
            # One motion is held for certain; nothing is divided by its zero.
            covariance=tuple(tuple(row) for row in np.diag([0.0, *[1e-6] * 5]).tolist()),
        )
        return alignment_fault(rule, SHAPES)

    assert fault_of(turned) is None
    # A scale of 1e-6 is a micrometre on a metre: no rounding.
    expected = ("alignment.rotation", "is not a rotation")
    assert fault_of((1.0 + 1e-6) * turned) == fault_of(-turned) == expected


@pytest.mark.parametrize(
    ("rule", "field", "words"),
    [
        (PlaneAxisPoint(plane="H", axis="X", point="S"), "plane", "needs one of: plane"),
        (PlaneAxisPoint(plane="A", axis="S", point="G"), "axis", "'S', but needs one of"),
        (DatumReferenceFrame(datums=("A", "B", "C", "H")), "datums", "names 4"),
        (DatumReferenceFrame(datums=("A", "A")), "datums", "names one feature twice"),
        (BestFit(points=("H", "G")), "points", "at least three"),
        (BestFit(points=("H", "G", "A")), "points", "needs one of: point"),
        (BestFit(points=("H", "G", "S"), weights=(1.0,)), "weights", "has 1 numbers"),
        (BestFit(points=("H", "G", "S"), weights=(1.0, 0.0, 1.0)), "weights", "not greater"),
        (BestFit(points=("H", "G", "S"), locked=("z",)), "start", "fixes the locked motions"),
        (
            ReferencePoints(conditions=SIX.conditions[:5]),
            "conditions",
            "exactly six constrain a part",
        ),
        (
            ReferencePoints(
                conditions=(*SIX.conditions[:5], Condition(feature="A", direction=(1.0, 0.0, 0.0)))
            ),
            "conditions[5].feature",
            "needs one of",
        ),
        (DatumAlignment(primary="A", secondary=("X",), origin="Q"), "origin", "'Q', which is not"),
        (
            DatumAlignment(primary="A", secondary=("X",), origin="S", secondary_axis="-z"),
            "secondary_axis",
            "the axis that the primary gives",
        ),
        (
            SavedFrame(
                name="m",
                digest="",
                rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)),
                translation=(0.0, 0.0, 0.0),
            ),
            "rotation",
            "is not a rotation",
        ),
        (Relocation(name="m", digest="", control=(), limit=0.0), "limit", "greater than zero"),
    ],
)
def test_what_a_plan_may_not_say(rule: Alignment, field: str, words: str) -> None:
    fault = alignment_fault(rule, SHAPES)
    assert fault is not None
    assert fault[0] == f"alignment.{field}"
    assert words in fault[1]
