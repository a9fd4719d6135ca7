"""Datum reference frames: precedence, open freedoms, senses, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.alignment import datum_frame
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import DIRECTION, POINT, element
from ocmm_core.geometry import RigidTransform, rotation_from_vector, unit
from tests.core.alignment.parts import NOMINALS, SHAPES, anywhere, measured

pytestmark = pytest.mark.numerics


@pytest.mark.parametrize(
    ("datums", "open_"),
    [
        ("ABC", ()),
        ("AHO", ()),
        ("AHG", ()),
        ("AHX", ()),
        ("AXC", ()),
        ("ZAX", ()),
        ("ZX", ()),
        ("SAX", ()),
        ("SXA", ()),
        ("XAH", ()),
        ("KAB", ()),
        ("KXA", ()),
        ("CSX", ()),
        ("HB", ("translation along z",)),
        ("SHX", ()),
        ("AO", ()),
        ("OA", ()),
        ("PSG", ()),
        ("A", ("rotation about z", "translation square to z")),
        ("X", ("rotation about y", "translation along y")),
        ("S", ("rotation about any axis",)),
        ("ZA", ("rotation about z",)),
        ("HA", ("rotation about z",)),
        ("H", ("rotation about z", "translation along z")),
        ("O", ("translation along z",)),
        ("AH", ("rotation about z",)),
        ("K", ("rotation about z",)),
        ("AB", ("translation along y",)),
        ("AX", ("translation along y",)),
        ("PS", ("rotation about (-0.876, 0.464, 0.134)",)),
    ],
)
def test_datums_in_any_precedence(datums: str, open_: tuple[str, ...]) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        T_world_from_part = anywhere(rng)
        geometries = measured(T_world_from_part, rng, depth=4.0)
        frame = datum_frame(list(datums), geometries, SHAPES, NOMINALS)
        assert frame.free.names() == open_
        # Places are hundreds of mm; the part has no error.
        assert max(max(item.offset, item.angle) for item in frame.misfits) < 1e-9
        off = frame.T_frame_from_world.compose(T_world_from_part)
        if not len(frame.free.turn):
            assert np.abs(off.rotation - np.eye(3)).max() < 1e-11
        if not open_:
            assert np.abs(off.translation).max() < 1e-9
        if len(frame.free.turn) == 1:
            axis = frame.free.turn[0]
            assert off.rotation @ axis == pytest.approx(axis, abs=1e-11)


@pytest.mark.parametrize("datums", ["A", "X", "S", "ZA", "AH", "AB", "PS", "K"])
def test_open_motions_leave_every_datum_in_place(datums: str) -> None:
    rng = np.random.default_rng(4)
    geometries = measured(anywhere(rng), rng)
    frame = datum_frame(list(datums), geometries, SHAPES, NOMINALS)
    motions = frame.free.motions()
    assert motions.shape == (6, frame.free.count)
    for motion in motions.T:
        size = 1e-3 * motion
        change = RigidTransform(rotation_from_vector(size[:3]), size[3:])
        moved = change.compose(frame.T_frame_from_world)
        for name in datums:
            at, wanted = moved.apply(geometries[name][POINT]), NOMINALS[name]
            if name in "AB":
                assert (at - wanted[POINT]) @ wanted[DIRECTION] == pytest.approx(0.0, abs=1e-9)
            elif name in "XZH":
                across = np.cross(at - wanted[POINT], wanted[DIRECTION])
                # A finite turn of a shift of 500 mm leaves its second order.
                assert np.abs(across).max() < 1e-4
            elif name != "K":
                assert np.abs(at - wanted[POINT]).max() < 1e-3


def test_a_secondary_plane_turns_the_part_and_does_not_tilt_it() -> None:
    """C is 1 degree off square to A: the angle stays in C, A is met fully, B only in place."""
    rng = np.random.default_rng(2)
    geometries = measured(RigidTransform.identity(), rng)
    tilt = rotation_from_vector(np.radians([1.0, 0.0, 2.0]))
    geometries["C"][DIRECTION] = tilt @ NOMINALS["C"][DIRECTION]
    geometries["C"][POINT] = NOMINALS["C"][POINT]
    frame = datum_frame(["A", "C", "B"], geometries, SHAPES, NOMINALS)
    misfits = {item.name: item for item in frame.misfits}
    assert frame.T_frame_from_world.rotation[2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert misfits["A"].angle < 1e-12
    assert np.degrees(misfits["C"].angle) == pytest.approx(1.0, abs=1e-3)
    assert np.degrees(misfits["B"].angle) == pytest.approx(2.0, abs=1e-3)
    assert max(item.offset for item in frame.misfits) < 1e-9
    other = datum_frame(["C", "A", "B"], geometries, SHAPES, NOMINALS)
    assert {item.name: item.angle for item in other.misfits}["C"] < 1e-12


def test_a_choice_is_taken_again() -> None:
    rng = np.random.default_rng(1)
    geometries = measured(anywhere(rng), rng)
    first = datum_frame(["Z", "X", "A"], geometries, SHAPES, NOMINALS)
    again = datum_frame(["Z", "X", "A"], geometries, SHAPES, NOMINALS, first.choice)
    assert np.array_equal(first.T_frame_from_world.rotation, again.T_frame_from_world.rotation)
    others = [
        datum_frame(["Z", "X", "A"], geometries, SHAPES, NOMINALS, choice)
        for choice in range(4)
        if choice != first.choice
    ]
    for other in others:
        assert other.misfits[2].angle > 1.0 or not np.allclose(
            other.T_frame_from_world.rotation, first.T_frame_from_world.rotation
        )


def test_the_datums_decide_over_senses_before_all_other_features() -> None:
    """Every other feature was probed on a part that is turned over about the axis of X."""
    rng = np.random.default_rng(7)
    T_world_from_part = anywhere(rng)
    over = RigidTransform(np.diag([-1.0, 1.0, -1.0]), np.array([120.0, 0.0, -20.0]))
    geometries = {
        **measured(T_world_from_part.compose(over), rng),
        **{k: v for k, v in measured(T_world_from_part, rng).items() if k in "XAH"},
    }
    frame = datum_frame(["X", "A", "H"], geometries, SHAPES, NOMINALS)
    off = frame.T_frame_from_world.compose(T_world_from_part)
    assert np.abs(off.rotation - np.eye(3)).max() < 1e-11


def test_what_hardly_holds_the_part_is_refused() -> None:
    rng = np.random.default_rng(1)
    geometries = measured(anywhere(rng), rng)
    nominals = {**NOMINALS, "C": element((0.0, 0.0, 9.0), (0.01, 0.0, 1.0))}
    with pytest.raises(FitError, match="C hardly constrains the part"):
        datum_frame(["A", "C"], geometries, SHAPES, nominals)
    nominals = {**NOMINALS, "X": element((60.0, 0.0, -10.0), unit(np.array([0.01, 0.0, 1.0])), 4.0)}
    with pytest.raises(FitError, match="X hardly constrains the part"):
        datum_frame(["A", "X"], geometries, SHAPES, nominals)
    nominals = {**NOMINALS, "G": element((20.3, 20.0, 0.0), (0.0, 0.0, 1.0), 5.0)}
    with pytest.raises(FitError, match="G hardly constrains the part"):
        datum_frame(["A", "H", "G"], geometries, SHAPES, nominals)


def test_a_missing_datum_or_nominal_is_named() -> None:
    geometries = measured(RigidTransform.identity(), np.random.default_rng(0))
    with pytest.raises(FitError, match="needs H, which is not measured"):
        datum_frame(["H"], {"A": geometries["A"]}, SHAPES, NOMINALS)
    with pytest.raises(FitError, match="nominal geometry of H"):
        datum_frame(["H"], geometries, SHAPES, {"A": NOMINALS["A"]})
    with pytest.raises(FitError, match="different datums, not none"):
        datum_frame([], geometries, SHAPES, NOMINALS)
    with pytest.raises(FitError, match="different datums, not A, A"):
        datum_frame(["A", "A"], geometries, SHAPES, NOMINALS)
