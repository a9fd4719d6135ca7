from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.acceptance import (
    AcceptanceSession,
    AcceptanceVerdict,
    differences,
    load_signed_record,
    procedure_files,
    recompute,
    save_record,
)
from ocmm_core.errors import OcmmError
from tests.core.acceptance.acceptance_site import ROOM, Machine, begin, room


@pytest.mark.parametrize("name", sorted(procedure_files()))
def test_a_good_machine_passes_every_procedure_and_the_record_gives_the_same_numbers(
    name: str, tmp_path: Path
) -> None:
    session = begin(tmp_path / "session.chain", name)
    machine = Machine(seed=1, sigma=0.001)
    machine.run(session)
    record = session.finish(machine.now, room(20.2))
    assert record.verdict is AcceptanceVerdict.PASS, record.quantities
    assert record.wording.startswith("modelled on")
    path = save_record(tmp_path, record)
    loaded = load_signed_record(path).record
    assert loaded == record
    assert differences(loaded, recompute(loaded)) == []
    assert AcceptanceSession.resume(session.path).record() == record


def test_lengths_are_those_of_the_certificate_in_35_values(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "LENGTH-7x5")
    Machine(scale=1.0 + 5e-5).run(session)
    values = session.view.values
    assert len(values) == 35
    assert {one.nominal_mm for one in values} == {60.0, 140.0, 220.0, 310.0, 400.0}
    for one in values:
        assert one.error_mm == pytest.approx(5e-5 * one.nominal_mm, abs=1e-9)
        assert one.limit_mm == pytest.approx(min(0.04 + 5e-5 * one.nominal_mm, 0.08))


def test_e0_takes_105_lengths_and_35_ranges(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "E0-105")
    Machine(sigma=0.001).run(session)
    values = session.view.values
    assert sum(one.quantity == "E" for one in values) == 105
    assert sum(one.quantity == "R0" for one in values) == 35


def test_one_line_that_failed_is_repeated_once_and_both_stay_in_the_record(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "LENGTH-7x5")
    bad = session.view.positions[3].name
    machine = Machine(per_position={bad: 1.0 + 3e-4})
    machine.run(session)
    assert session.view.verdict is AcceptanceVerdict.FAIL
    again = session.retest(machine.now)
    assert [one.name for one in again] == [f"{bad}, again"]
    machine.run(session)
    record = session.finish(machine.now, ROOM)
    assert record.verdict is AcceptanceVerdict.PASS
    assert len(record.values) == 40
    assert sum(one.superseded for one in record.values) == 5
    assert all(one.position == bad for one in record.values if one.superseded)
    assert recompute(record) == record
    with pytest.raises(OcmmError, match="finished"):
        session.retest(machine.now)


def test_a_retest_that_fails_too_fails(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "LENGTH-7x5")
    bad = session.view.positions[3].name
    machine = Machine(per_position={bad: 1.0 + 3e-4, f"{bad}, again": 1.0 + 3e-4})
    machine.run(session)
    session.retest(machine.now)
    machine.run(session)
    with pytest.raises(OcmmError, match="1 of 1 retests"):
        session.retest(machine.now)
    assert session.finish(machine.now, ROOM).verdict is AcceptanceVerdict.FAIL


def test_two_lines_that_failed_are_not_repeated(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "LENGTH-7x5")
    names = [one.name for one in session.view.positions[:2]]
    machine = Machine(per_position=dict.fromkeys(names, 1.0 + 3e-4))
    machine.run(session)
    with pytest.raises(OcmmError, match="2 lines failed"):
        session.retest(machine.now)
    assert session.finish(machine.now, ROOM).verdict is AcceptanceVerdict.FAIL


def test_a_set_of_e0_with_one_value_outside_is_measured_again(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "E0-105", limits=_wide_ranges())
    machine = Machine()
    count = 0
    while session.view.current >= 0:
        view = session.view
        position = view.positions[view.current]
        tip = machine.see(position, view.next_item)
        if count == 5:  # the last nest of the first sweep of the first position
            along = np.array(position.points_world[-1]) - np.array(position.points_world[0])
            tip = tip + 0.075 * along / np.linalg.norm(along)
        if view.needs_temperature:
            session.note_temperature(ROOM, machine.now)
        session.record_point(tip, machine.now)
        count += 1
    assert session.view.verdict is AcceptanceVerdict.FAIL
    again = session.retest(machine.now)
    assert [len(one.points_world) * one.repeats for one in again] == [6]
    machine.run(session)
    record = session.finish(machine.now, ROOM)
    assert record.verdict is AcceptanceVerdict.PASS
    assert recompute(record) == record


def _wide_ranges() -> object:
    from ocmm_core.acceptance import find_procedure, load_procedure

    limits = dict(load_procedure(find_procedure("E0-105"))[0].limits)
    limits["R0"] = msgspec.structs.replace(limits["R0"], constant=0.1)
    return limits


def test_a_temperature_that_drifts_makes_the_test_void_not_failed(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "SPHERE-25")
    machine = Machine()
    machine.run(session)
    record = session.finish(machine.now, room(22.5))
    assert record.verdict is AcceptanceVerdict.VOID
    assert "2.5 K within an hour" in record.void_reasons[0]
    assert recompute(record) == record


def test_the_uncertainty_of_the_artefact_counts_against_who_wants_to_prove(tmp_path: Path) -> None:
    for rule, verdict in (
        ("guarded", AcceptanceVerdict.LEANING_IN),
        ("simple", AcceptanceVerdict.PASS),
    ):
        session = begin(tmp_path / rule, "LENGTH-7x5", rule=rule)
        machine = Machine(scale=1.0 + 0.0599 / 400.0)
        machine.run(session)
        assert session.finish(machine.now, ROOM).verdict is verdict


def test_an_artefact_expands_with_the_temperature(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "LENGTH-7x5")
    machine = Machine(celsius=20.9)
    session.note_temperature(room(20.9), machine.now)
    machine.run(session)
    longest = max(session.view.values, key=lambda one: one.nominal_mm)
    assert longest.certified_mm > 400.0 + 400.0 * 1e-6 * 0.4


def test_the_order_of_positions_is_drawn_from_the_seed(tmp_path: Path) -> None:
    orders = [
        tuple(one.name for one in begin(tmp_path / str(i), "LENGTH-7x5", seed=seed).view.positions)
        for i, seed in enumerate((1, 1, 2))
    ]
    assert orders[0] == orders[1] != orders[2]


def test_a_changed_byte_of_a_record_is_noticed(tmp_path: Path) -> None:
    session = begin(tmp_path / "s", "SPAT")
    machine = Machine(sigma=0.001)
    machine.run(session)
    path = save_record(tmp_path, session.finish(machine.now, ROOM))
    content = path.read_bytes()
    path.write_bytes(content.replace(b'"PASS"', b'"FAIL"', 1))
    with pytest.raises(OcmmError, match="changed"):
        load_signed_record(path)
