"""A test as a guided procedure, its choices, and the interim check with a store."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from ocmm_core.acceptance import (
    AcceptanceRecord,
    AcceptanceSession,
    AcceptanceVerdict,
    InterimHistory,
    InterimWord,
    Stage,
    finished_tests,
    note_check,
    offered_artefacts,
    open_tests,
    save_record,
    typed_entry,
)
from ocmm_core.calibration.records import EventKind, State
from ocmm_core.composition import AcceptanceBench, StatedConditions, StationRequest
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError
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
from tests.core.calibration.procedure_site import BEGIN as CALIBRATED
from tests.core.calibration.procedure_site import Bench

_FIELDS = {
    "id": "S-1", "kind": "sphere", "name": "Sphere", "serial": "4711", "laboratory": "Lab",
    "certificate": "C-1", "due_utc": "2030-01-01", "sizes": "25.0003", "expanded": "0.0003",
    "expansion": "5.5e-6", "expansion_sigma": "5e-7",
}  # fmt: skip


def _bench(folder: Path, calibrations: Path | None = None) -> AcceptanceBench:
    request = StationRequest(
        plan=resource("plans", "quick.toml"), out=folder / "job", calibrations=calibrations
    )
    return AcceptanceBench(request, folder=folder / "tests", register=folder / "artefacts")


def test_a_test_begins_on_its_first_page_goes_on_at_its_points_and_is_ended_once(
    tmp_path: Path,
) -> None:
    bench, now = _bench(tmp_path), datetime.now(UTC)
    offer = next(one for one in bench.procedures(now) if one.procedure.id == "INTERIM")
    (dumbbell,) = bench.offers(offer, now, ROOM)
    assert not dumbbell.refusal
    with pytest.raises(InputError, match="No name given"):
        bench.start(offer, (dumbbell.used,), StatedConditions(who=" "), now)
    procedure = bench.start(offer, (dumbbell.used,), StatedConditions(who="Ann"), now)
    assert [one.name for one in procedure.base.steps] == ["prepare", "measure", "result"]
    with pytest.raises(CalibrationError, match="No frames yet"):
        procedure.record(now)
    with pytest.raises(CalibrationError, match="not taken back"):
        procedure.drop(now)
    procedure.advance(now)
    with pytest.raises(CalibrationError, match="10 points to go"):
        procedure.advance(now)
    with pytest.raises(CalibrationError, match="10 points are missing"):
        procedure.compute()
    (open_one,) = bench.unfinished(now)
    assert (open_one.who, open_one.done, open_one.wanted) == ("Ann", 0, 10)
    again = bench.resume(open_one.path, ROOM)
    again.keep(now, "wrong artefact")
    assert bench.unfinished(now) == ()
    with pytest.raises(CalibrationError, match="finished"):
        again.set_temperature(21.0, now)


def test_a_verdict_that_was_given_but_not_stored_is_offered_again(tmp_path: Path) -> None:
    machine = Machine(seed=1, sigma=0.001)
    session = begin(tmp_path / "sessions" / "x.chain", "EFFECTIVE-DIAMETER")
    machine.run(session)
    assert [one.done for one in open_tests(tmp_path, INSTRUMENT)] == [27]
    record = session.finish(machine.now, ROOM, "the door was open")
    assert "Remark: the door was open" in record.notes
    # The program ended here: the record is not on the disk.
    assert len(open_tests(tmp_path, INSTRUMENT)) == 1
    save_record(tmp_path / "records", record)
    assert open_tests(tmp_path, INSTRUMENT) == ()
    (found,), unread = finished_tests(tmp_path)
    assert (found.record, unread) == (record, ())


def test_a_test_of_another_calibration_does_not_go_on(tmp_path: Path) -> None:
    begin(tmp_path / "sessions" / "x.chain", "EFFECTIVE-DIAMETER")
    other = msgspec.structs.replace(INSTRUMENT, calibration="d" * 64)
    (found,) = open_tests(tmp_path, other)
    assert "another calibration of the cameras" in found.blocker


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"expanded": 0.02}, "U"), ({"sizes": (5.0,)}, "10 to 51 mm"), ({"form": 0.05}, "form error")],
)
def test_what_may_not_be_used_is_offered_with_its_sentence(
    wrong: dict[str, object], message: str
) -> None:
    stage, _ = stage_of("SPHERE-25")
    bare = Stage(stage.procedure, stage.instrument, (), 1)
    bad = artefact("sphere", **{"sizes": (30.0,), **wrong})
    good, refused = offered_artefacts(
        bare, [("bad", bad), ("bar", ARTEFACTS[0]), ("good", ARTEFACTS[1])], BEGIN, ROOM
    )
    assert (good.name, good.refusal) == ("good", "")
    assert refused.name == "bad"
    assert message in refused.refusal


def test_an_expired_artefact_is_refused_by_its_date() -> None:
    stage, _ = stage_of("SPHERE-25")
    bare = Stage(stage.procedure, stage.instrument, (), 1)
    late = BEGIN + timedelta(days=4000)
    (found,) = offered_artefacts(bare, [("S", ARTEFACTS[1])], late, ROOM)
    assert "2030-01-01" in found.refusal


def test_what_is_typed_becomes_an_entry_or_says_which_field_is_wrong() -> None:
    entry = typed_entry(_FIELDS)
    assert (entry.sizes, entry.expanded, entry.form) == ((25.0003,), 0.0003, 0.0)
    bar = typed_entry({**_FIELDS, "kind": "bar", "sizes": "0; 100,5 200"})
    assert bar.sizes == (0.0, 100.5, 200.0)
    for field, value in (
        ("expanded", "x"), ("expanded", "nan"), ("sizes", "25 mm"), ("due_utc", "soon"),
        ("id", ""), ("kind", "ball"), ("serial", "-"), ("sizes", ""),
    ):  # fmt: skip
        with pytest.raises(InputError) as caught:
            typed_entry({**_FIELDS, field: value})
        assert field.removesuffix("_utc")[:4] in caught.value.what, field


def _check(
    folder: Path, number: int, calibration: str, scale: float, now: datetime
) -> AcceptanceRecord:
    """Return the record of an interim check of a machine whose lengths are off by a factor."""
    stage, digest = stage_of("INTERIM", seed=number)
    instrument = msgspec.structs.replace(stage.instrument, calibration=calibration)
    stage = Stage(stage.procedure, instrument, stage.artefacts, number)
    session = AcceptanceSession.start(
        folder / f"{number}.chain", stage, digest, now, temperature=ROOM, who="Ann"
    )
    machine = Machine(seed=number, sigma=0.0005, scale=scale, now=now)
    machine.run(session)
    return session.finish(machine.now, ROOM)


@pytest.mark.slow
def test_a_check_that_is_out_twice_holds_points_back_until_a_verification(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    bench.calibrated(120)
    store, history = bench.store(), InterimHistory(tmp_path)
    calibration = store.active_hash
    assert calibration is not None
    now = CALIBRATED + timedelta(days=1)
    checks = tmp_path / "checks"
    good = [_check(checks, one, calibration, 1.0, now + timedelta(hours=one)) for one in (1, 2)]
    for record in good:
        chart = note_check(history, record, store, now)
        assert chart.word is InterimWord.LEARNING
    # 200 mm are measured 0.2 mm too long.
    bad = [_check(checks, one, calibration, 1.001, now + timedelta(hours=one)) for one in (3, 4)]
    assert note_check(history, bad[0], store, now).word is InterimWord.REPEAT
    assert all(one.kind is not EventKind.SUSPECTED for one in store.events)
    stop = now + timedelta(hours=5)
    chart = note_check(history, bad[1], store, stop)
    assert chart.word is InterimWord.STOP
    last = bench.store().events[-1]
    assert last.kind is EventKind.SUSPECTED
    assert last.calibration == calibration
    assert "interim check is out" in last.reason
    # Points are held back since the last good check, not since the first bad one.
    assert last.since_utc is not None
    assert datetime.fromisoformat(last.since_utc) == chart.last_good
    assert chart.last_good == datetime.fromisoformat(good[1].ended_utc)
    assert bench.store().status(stop).state is State.SUSPECT
    # Stored once more after an interruption: neither chart nor store hears of it twice.
    count = len(bench.store().events)
    again = note_check(InterimHistory(tmp_path), bad[1], bench.store(), stop)
    assert len(again.points) == 4
    assert len(bench.store().events) == count


def test_a_void_check_is_not_on_the_chart(tmp_path: Path) -> None:
    record = _check(tmp_path / "checks", 1, "c" * 64, 1.0, BEGIN)
    void = msgspec.structs.replace(
        record, void_reasons=("too warm",), verdict=AcceptanceVerdict.VOID
    )
    assert note_check(InterimHistory(tmp_path), void, None, BEGIN).points == ()


def test_the_register_says_which_procedures_refuse_an_artefact(tmp_path: Path) -> None:
    bench, now = _bench(tmp_path), datetime.now(UTC)
    coarse = typed_entry({**_FIELDS, "expanded": "0.02"})
    bench.artefacts().add(coarse, "Ann", now)
    said = dict(bench.refused_for(coarse, now))
    assert "SPHERE-25" in said
    assert said["SPHERE-25"]
    fine = dict(bench.refused_for(typed_entry(_FIELDS), now))
    assert fine["SPHERE-25"] == ""
