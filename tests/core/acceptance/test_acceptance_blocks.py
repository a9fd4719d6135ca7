"""Gauge blocks from both sides, the long stylus, and the octants of a volumetric test."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.acceptance import (
    AcceptanceSession,
    AcceptanceVerdict,
    PlannedPosition,
    Stage,
    plan_of,
    values_of,
)
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, rotation_xyz
from tests.core.acceptance.acceptance_site import (
    ARTEFACTS,
    BEGIN,
    INSTRUMENT,
    ROOM,
    Machine,
    artefact,
    begin,
    stage_of,
)


@dataclass
class BlockMachine(Machine):
    """Touches a block that lies askew, with a ball that is larger than the machine believes."""

    ball_error: float = 0.0
    lean_deg: float = 0.0
    squeeze: float = 1.0
    """A machine with an error of points towards the middle of their face, along its narrow side."""

    def see(self, position: PlannedPosition, item: int) -> Float:
        if position.role != "gauge block":
            return Machine.see(self, position, item)
        points = np.array(position.points_world)
        half = len(points) // 2
        middle = points.mean(axis=0)
        side = -1.0 if item < half else 1.0
        face = points[:half].mean(axis=0) if item < half else points[half:].mean(axis=0)
        arm = points[item] - face
        arm[1] *= self.squeeze
        point = face + arm + np.array([side * self.ball_error, 0.0, 0.0]) - middle
        turn = rotation_xyz(0.0, np.radians(self.lean_deg), np.radians(0.5 * self.lean_deg))
        seen: Float = middle + turn @ point + self.sigma * self.rng.standard_normal(3)
        return seen


def blocks(session: AcceptanceSession) -> list[float]:
    return [v.error_mm for v in session.view.values if v.position.startswith("gauge block")]


def short(path: Path) -> AcceptanceSession:
    """Begin with two positions of the bar: this test is about the block."""
    stage, _ = stage_of("E0-105-BLOCK")
    return begin(
        path, "E0-105-BLOCK", test=msgspec.structs.replace(stage.procedure.test, positions=2)
    )


def run(path: Path, machine: Machine) -> AcceptanceSession:
    session = short(path)
    machine.run(session)
    return session


def test_a_block_is_measured_three_times_beside_the_bar(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "E0-105-BLOCK")
    BlockMachine().run(session)
    values = session.view.values
    assert sum(v.quantity == "E" for v in values) == 105 + 3
    assert sum(v.quantity == "R0" for v in values) == 35
    np.testing.assert_allclose(blocks(session), 0.0, atol=1e-9)


def test_an_error_of_the_ball_shows_in_the_block_alone(tmp_path: Path) -> None:
    session = run(tmp_path / "s", BlockMachine(ball_error=0.030))
    np.testing.assert_allclose(blocks(session), 0.060, atol=1e-9)
    record = session.finish(BEGIN.replace(hour=12), ROOM)
    assert record.verdict is AcceptanceVerdict.FAIL
    bars = [v for v in record.values if v.quantity == "E" and "space" in v.position]
    assert all(v.verdict is AcceptanceVerdict.PASS for v in bars)


def test_a_block_that_lies_askew_has_its_length(tmp_path: Path) -> None:
    # Along the planned direction, 8 degrees would make it 0.25 mm shorter.
    session = run(tmp_path / "s", BlockMachine(lean_deg=8.0))
    np.testing.assert_allclose(blocks(session), 0.0, atol=1e-9)


def test_scatter_of_the_block_is_that_of_averaged_points(tmp_path: Path) -> None:
    sigma, errors = 0.004, []
    for seed in range(60):
        stage, digest = stage_of("E0-105-BLOCK", seed=seed)
        del digest
        position = next(one for one in plan_of(stage)[0] if one.role == "gauge block")
        machine = BlockMachine(seed=seed, sigma=sigma, lean_deg=3.0)
        count = len(position.points_world)
        tips = np.array([machine.see(position, one) for one in range(count)] * 1)
        from ocmm_core.acceptance import block_length, faces_normal

        one, two = tips[: count // 2], tips[count // 2 :]
        errors.append(block_length(one, two, faces_normal(one, two), 3.0) - 25.0003)
    # Two means of five points: sigma sqrt(2 / 5); 60 values determine their sd to 9 %.
    assert np.std(errors) == pytest.approx(sigma * np.sqrt(2.0 / 5.0), rel=0.3)
    assert abs(np.mean(errors)) < 4.0 * sigma * np.sqrt(2.0 / 5.0) / np.sqrt(60.0)


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        (BlockMachine(squeeze=0.08), "lie on a line"),
        (BlockMachine(ball_error=0.8), "probe both measuring faces"),
    ],
)
def test_points_that_do_not_show_a_block_are_taken_anew(
    tmp_path: Path, machine: BlockMachine, words: str
) -> None:
    session, hint = short(tmp_path / "s"), ""
    while session.view.current >= 0 and not hint:
        hint = machine.step(session)
    assert words in hint
    assert not [v for v in session.view.values if v.position.startswith("gauge block")]


@pytest.mark.parametrize(
    ("artefacts", "words"),
    [
        (ARTEFACTS[:1], "needs a gauge block"),
        ((ARTEFACTS[0], artefact("gauge block", 50.0, expanded=0.0002)), "30 mm are allowed"),
        ((ARTEFACTS[0], artefact("gauge block", 25.0, expanded=0.02)), "certified to 20.0 um"),
    ],
)
def test_a_block_that_cannot_show_it_is_refused(
    tmp_path: Path, artefacts: tuple[object, ...], words: str
) -> None:
    stage, digest = stage_of("E0-105-BLOCK")
    stage = Stage(stage.procedure, stage.instrument, artefacts, 1)  # type: ignore[arg-type]
    with pytest.raises(CalibrationError) as caught:
        AcceptanceSession.start(
            tmp_path / "s", stage, digest, BEGIN, temperature=ROOM, who="tester"
        )
    assert words in caught.value.what
    assert not (tmp_path / "s").exists()


def test_an_expired_block_is_refused(tmp_path: Path) -> None:
    old = artefact("gauge block", 25.0, expanded=0.0002)
    old = msgspec.structs.replace(
        old, use=msgspec.structs.replace(old.use, due_utc="2026-01-01T00:00:00+00:00")
    )
    stage, digest = stage_of("E0-105-BLOCK")
    stage = Stage(stage.procedure, stage.instrument, (ARTEFACTS[0], old), 1)
    with pytest.raises(CalibrationError, match="expired"):
        AcceptanceSession.start(
            tmp_path / "s", stage, digest, BEGIN, temperature=ROOM, who="tester"
        )


def test_several_blocks_are_told_apart(tmp_path: Path) -> None:
    two = artefact("gauge block", 10.0005, expanded=0.0002)
    stage, digest = stage_of("E0-105-BLOCK")
    short_test = msgspec.structs.replace(stage.procedure.test, positions=2)
    procedure = msgspec.structs.replace(stage.procedure, test=short_test)
    stage = Stage(procedure, stage.instrument, (*ARTEFACTS, two), 1)
    session = AcceptanceSession.start(
        tmp_path / "s", stage, digest, BEGIN, temperature=ROOM, who="tester"
    )
    BlockMachine().run(session)
    found = {v.nominal_mm for v in values_of(session.state.situation()) if "gauge" in v.position}
    assert found == {25.0003, 10.0005}
    np.testing.assert_allclose(blocks(session), 0.0, atol=1e-9)


def test_a_set_of_a_block_with_one_value_outside_is_measured_again(tmp_path: Path) -> None:
    session, machine = short(tmp_path / "s"), BlockMachine()
    while session.view.current >= 0:
        view = session.view
        plan = view.positions[view.current]
        first = view.done[view.current] < len(plan.points_world)
        machine.ball_error = 0.030 if plan.role == "gauge block" and first else 0.0
        assert machine.step(session) == ""
    (again,) = session.retest(machine.now)
    assert again.role == "gauge block"
    machine.ball_error = 0.0
    machine.run(session)
    record = session.finish(machine.now, ROOM)
    assert record.verdict is AcceptanceVerdict.PASS
    assert sum(v.superseded for v in record.values) == 3


def test_the_long_stylus_is_judged_as_what_it_is(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "EL-30")
    Machine(scale=1.0 + 5e-5).run(session)
    values = session.view.values
    assert {v.quantity for v in values} == {"E_L", "R0"}
    assert sum(v.quantity == "E_L" for v in values) == 30
    assert len({v.position for v in values}) == 2
    assert any("131.6 mm from the ball" in note for note in session.notes)


@pytest.mark.parametrize("stylus", [0.0, 124.9])
def test_a_short_stylus_is_no_long_one(tmp_path: Path, stylus: float) -> None:
    stage, digest = stage_of("EL-30")
    short = msgspec.structs.replace(INSTRUMENT, stylus=stylus)
    with pytest.raises(CalibrationError, match="nearest LED"):
        AcceptanceSession.start(
            tmp_path / "s", Stage(stage.procedure, short, ARTEFACTS, 1), digest, BEGIN,
            temperature=ROOM, who="tester",
        )  # fmt: skip


@dataclass
class Corner(Machine):
    """Puts the bar of some placements on the other side of the middle, along Z."""

    octant: tuple[int, ...] = ()

    def see(self, position: PlannedPosition, item: int) -> Float:
        point = Machine.see(self, position, item)
        middle = np.array(position.points_world).mean(axis=0)
        if middle[2] > 0.0 and middle[0] > 0.0 and middle[1] > 0.0 and self.octant:
            point[2] -= 2.0 * middle[2]
        return point


def test_placements_that_would_leave_an_octant_empty_are_taken_anew(tmp_path: Path) -> None:
    stage, digest = stage_of("VOLUMETRIC")
    session = AcceptanceSession.start(
        tmp_path / "s", stage, digest, BEGIN, temperature=ROOM, who="tester"
    )
    machine, hints = Corner(octant=(7,)), []
    for _ in range(400):
        if session.view.current < 0:
            break
        try:
            hint = machine.step(session)
        except CalibrationError as error:
            # Farther from its start than a placement may be: the engine reports it at once.
            hint = error.what
        if hint:
            hints.append(hint)
            machine.octant = ()
    assert session.view.current < 0
    assert hints
    record = session.finish(machine.now, ROOM)
    assert record.verdict is AcceptanceVerdict.PASS
