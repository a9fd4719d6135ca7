"""Coordinate systems of I++ DME against SciPy's rotations, and the text of numbers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ocmm_serve.ippdme import CsyFrames, ShiftSign
from ocmm_serve.ippdme._frames import CHAIN, CsyTransformation
from ocmm_serve.ippdme._grammar import DmeError, call_text, number_text

_N = 1000


def test_documented_angles_give_the_documented_row() -> None:
    row = CsyTransformation(theta=30.0, psi=40.0, phi=50.0).rotation()[0]
    assert row == pytest.approx([0.065970, 0.921380, 0.383022], abs=1e-6)


@pytest.mark.parametrize("sign", ShiftSign)
def test_random_systems_agree_with_scipy(sign: ShiftSign) -> None:
    rng = np.random.default_rng(42)
    for _ in range(_N):
        frames = CsyFrames(sign)
        # The ball: a tool of any length in any attitude.
        tool = rng.uniform(-200.0, 200.0, 3)
        attitude = Rotation.random(random_state=rng)
        ball = rng.uniform(-500.0, 500.0, 3) + attitude.apply(tool)
        normal = attitude.apply([0.0, 0.0, 1.0])
        expected, way = ball, normal
        chosen = [name for name in CHAIN if rng.random() < 0.6] or ["PartCsy"]
        for name in chosen:
            shift = rng.uniform(-1000.0, 1000.0, 3)
            theta, psi, phi = rng.uniform([0.0, -400.0, -400.0], [180.0, 400.0, 400.0])
            frames = frames.transformed(name, (*shift.tolist(), theta, psi, phi))
            # Child to parent, extrinsic: phi about z, theta about x, psi about z.
            turn = Rotation.from_euler("zxz", [phi, theta, psi], degrees=True).inv()
            way = turn.apply(way)
            if sign is ShiftSign.ORIGIN:
                expected = turn.apply(expected - shift)
            else:
                expected = turn.apply(expected) + shift
        frames = frames.activated(chosen[-1])
        found = frames.active_from_machine()
        # 1e-9 mm: rounding of sums of some metres is 1e-12.
        assert np.abs(found.apply(ball) - expected).max() < 1e-9
        assert np.abs(found.rotation @ normal - way).max() < 1e-12
        assert np.abs(found.inverse().apply(expected) - ball).max() < 1e-9


def test_the_signs_of_the_shift_differ_as_the_editions_do() -> None:
    ball = np.array([2.0, 3.0, 4.0])
    found = {}
    for sign in ShiftSign:
        frames = CsyFrames(sign).transformed("PartCsy", (5.0, 6.0, 7.0, 0.0, 0.0, 0.0))
        found[sign] = frames.activated("PartCsy").active_from_machine().apply(ball).tolist()
    assert found == {ShiftSign.ORIGIN: [-3.0, -3.0, -3.0], ShiftSign.OFFSET: [7.0, 9.0, 11.0]}


@pytest.mark.parametrize(
    ("name", "values", "number"),
    [("PartCsy", (0, 0, 0, 180.1, 0, 0), 1007), ("PartCsy", (0, 0, 0, -0.1, 0, 0), 1007),
     ("PartCsy", (2e6, 0, 0, 0, 0, 0), 509), ("MachineCsy", (0,) * 6, 505)],
)  # fmt: skip
def test_rejects_impossible_transformations(
    name: str, values: tuple[float, ...], number: int
) -> None:
    with pytest.raises(DmeError) as raised:
        CsyFrames().transformed(name, values)
    assert raised.value.number == number


def test_numbers_have_at_most_16_characters_and_keep_nanometres() -> None:
    rng = np.random.default_rng(7)
    for value in (rng.normal(size=5000) * 10.0 ** rng.integers(-9, 15, 5000)).tolist():
        text = number_text(value)
        assert len(text) <= 16, text
        assert float(text) == pytest.approx(value, abs=0.5000001e-6, rel=1e-8)
    assert call_text("X", -1e-9, 0.0, 100.0, 2.5, -99999999.123456) == (
        "X(0, 0, 100, 2.5, -99999999.123456)"
    )
    with pytest.raises(ValueError, match="cannot be sent"):
        number_text(float("nan"))
