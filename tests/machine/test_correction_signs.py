"""A virtual part is cut with the correction and measured again: the error becomes smaller."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_machine import correction_file, propose
from tests.host import amount
from tests.machine.cut_parts import NOON, all_axes, document, frame_of, line_of, measured, part
from tests.machine.machine_tool import SimulatedMill, WorkOffset, turned

PLACES = {"A": np.array([40.0, 10.0, -5.0]), "B": np.array([-60.0, 35.0, 12.0]),
          "C": np.array([15.0, -70.0, 30.0])}  # fmt: skip
WORK = ("x", "y", "z", "c")
_WORD = re.compile(r"L2 P1 ([XYZR])(-?\d+\.\d+)")


def _offset_of(text: str, before: tuple[float, ...]) -> tuple[float, ...]:
    """Return the work offset after a file of LinuxCNC."""
    found = {letter: float(number) for letter, number in _WORD.findall(text)}
    return tuple(found.get(one, old) for one, old in zip("XYZR", before, strict=True))


def _cut(mill: SimulatedMill, now: tuple[float, ...]) -> Float:
    offset = WorkOffset((now[0], now[1], now[2]), now[3])
    return mill.cut_places(np.array([*PLACES.values()]), offset, mill.length)


def _errors(mill: SimulatedMill, now: tuple[float, ...]) -> Float:
    errors: Float = _cut(mill, now) - np.array([*PLACES.values()])
    return errors


def _measure(mill: SimulatedMill, now: tuple[float, ...], rng: np.random.Generator) -> list[float]:
    """Return deviations of all coordinates, measured with U = 2 um."""
    return (_errors(mill, now) + rng.normal(0.0, 0.001, (3, 3))).ravel().tolist()


@pytest.mark.parametrize("case", range(48))
def test_the_error_gets_smaller_with_all_axes_and_hands(case: int, tmp_path: Path) -> None:
    axes = all_axes()[case]
    rng = np.random.default_rng([46, case])
    names = [(place, axis) for place in PLACES for axis in "xyz"]
    for _ in range(amount(2, 20)):
        before = (*rng.uniform(-300, 300, 3).round(3), round(float(rng.uniform(-170, 170)), 3))
        wrong = (*rng.uniform(-0.08, 0.08, 3), rng.uniform(-0.05, 0.05))
        truth = WorkOffset(
            (before[0] + wrong[0], before[1] + wrong[1], before[2] + wrong[2]), before[3] + wrong[3]
        )
        mill = SimulatedMill(axes, truth)
        plan = document(
            tmp_path,
            [{"name": f"G54 {axis}", "kind": "work", "axis": axis, "number": 1,
              "present": float(value)} for axis, value in zip(WORK, before, strict=True)],
            [{"characteristic": f"{place} {axis}", "offsets": [f"G54 {one}" for one in WORK],
              "acts": "position", "direction": f"+{axis.upper()}"} for place, axis in names],
            frame_of(axes),
        )  # fmt: skip
        values = [
            measured(f"{place} {axis}", "coordinate", error, axis=axis, feature=place)
            for (place, axis), error in zip(names, _measure(mill, before, rng), strict=True)
        ]
        found = propose(plan, [part(values, places=PLACES)], [])
        assert found.changed, found
        text = correction_file(plan, line_of(found, NOON), "linuxcnc", practice=False).decode()
        after = _offset_of(text, before)
        old, new = (float(np.linalg.norm(_errors(mill, one))) for one in (before, after))
        # An offset below its dead band stays: 4 um of X, Y and Z, and 2 mdeg at 80 mm, or U.
        assert new < 0.02
        assert new < 0.5 * old
        predicted = [one.predicted for one in found.effects]
        # Predicted are the measured errors, which scatter by 1 um, and rounding is below 1 um.
        np.testing.assert_allclose(
            np.array(predicted, dtype=np.float64), _errors(mill, after).ravel(), atol=0.006
        )


@pytest.mark.parametrize("counts", ["radius", "diameter"])
@pytest.mark.parametrize("acts", ["outer", "inner"])
@pytest.mark.parametrize("kind", ["diameter", "radius", "width"])
def test_radius_wear(counts: str, acts: str, kind: str, tmp_path: Path) -> None:
    mill = SimulatedMill(np.eye(3), WorkOffset((0.0, 0.0, 0.0)), radius=4.97)
    plan = document(
        tmp_path,
        [{"name": "D3", "kind": "radius", "number": 3, "counts": counts}],
        [{"characteristic": "size", "offsets": ["D3"], "acts": acts}],
    )
    cut = mill.boss if acts == "outer" else mill.bore
    part_of_size = 0.5 if kind == "radius" else 1.0
    error = (cut(30.0, 5.0) - 30.0) * part_of_size
    assert abs(error) > 0.02
    found = propose(plan, [part([measured("size", kind, error)])], [])
    (change,) = found.changed
    radius = change.after * (0.5 if counts == "diameter" else 1.0)
    assert abs(cut(30.0, 5.0 + radius) - 30.0) < 0.002


@pytest.mark.parametrize("axes", all_axes()[:8])
def test_length_wear(axes: Float, tmp_path: Path) -> None:
    """A plane that faces the spindle, in any pose of the part."""
    mill = SimulatedMill(axes, WorkOffset((10.0, 20.0, 30.0)), length=99.95)
    up = frame_of(axes)["z"]
    plan = document(
        tmp_path,
        [{"name": "H3", "kind": "length", "number": 3}],
        [{"characteristic": "step", "offsets": ["H3"], "acts": "position", "direction": up}],
        frame_of(axes),
    )

    def height(length: float) -> float:
        cut = mill.cut_places(np.zeros((1, 3)), mill.clamped, length)[0]
        return float(cut @ axes[2])

    found = propose(plan, [part([measured("step", "distance", height(100.0))])], [])
    (change,) = found.changed
    assert abs(height(100.0)) > 0.04
    assert abs(height(100.0 + change.after)) < 0.002


@pytest.mark.parametrize("counts", ["radius", "diameter"])
@pytest.mark.parametrize("acts", ["outer", "inner"])
def test_turning_tool(counts: str, acts: str, tmp_path: Path) -> None:
    plan = document(
        tmp_path,
        [{"name": "T5 X", "kind": "turn-x", "number": 5, "counts": counts}],
        [{"characteristic": "size", "offsets": ["T5 X"], "acts": acts}],
    )
    error = turned(40.0, 0.021, 0.0) - 40.0
    found = propose(plan, [part([measured("size", "diameter", error)])], [])
    (change,) = found.changed
    offset = change.after * (0.5 if counts == "diameter" else 1.0)
    assert abs(turned(40.0, 0.021, offset) - 40.0) < 0.003


def test_a_wrong_sign_of_an_axis_is_refused(tmp_path: Path) -> None:
    offsets = [{"name": "X", "kind": "work", "axis": "x", "number": 1}]
    drives = [{"characteristic": "A", "offsets": ["X"], "acts": "position", "direction": "+X"}]
    for axes in all_axes():
        frame = frame_of(axes)
        document(tmp_path, offsets, drives, frame)
        for axis in "xyz":
            text = str(frame[axis])
            wrong = {**frame, axis: ("-" if text[0] == "+" else "+") + text[1]}
            with pytest.raises(InputError, match="frame"):
                document(tmp_path, offsets, drives, wrong)


def test_a_direction_against_the_plan_is_refused(tmp_path: Path) -> None:
    plan = document(
        tmp_path, [{"name": "X", "kind": "work", "axis": "x", "number": 1}],
        [{"characteristic": "A", "offsets": ["X"], "acts": "position", "direction": "-X"}],
    )  # fmt: skip
    with pytest.raises(InputError, match="contradicts the plan"):
        propose(plan, [part([measured("A", "coordinate", 0.1, axis="x")])], [])
