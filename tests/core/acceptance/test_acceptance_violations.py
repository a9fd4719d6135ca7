"""200 seeded violations of plans and rules: every one is refused with a sentence."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.acceptance import (
    AcceptanceSession,
    AcceptanceVerdict,
    EarlierUse,
    Stage,
    UsedArtefact,
    spots_hash,
)
from ocmm_core.errors import OcmmError
from tests.core.acceptance.acceptance_site import (
    ARTEFACTS,
    BEGIN,
    ROOM,
    Machine,
    begin,
    room,
    stage_of,
)

Violation = Callable[[Path, np.random.Generator], str]
_LENGTH = ("LENGTH-7x5", "E0-105")


def _begin(
    path: Path, name: str, artefacts: tuple[UsedArtefact, ...] = ARTEFACTS, *,
    celsius: float = 20.0, status: str = "VALID", **given: object,
) -> str:  # fmt: skip
    stage, digest = stage_of(name)
    instrument = msgspec.structs.replace(stage.instrument, calibration_status=status)
    stage = Stage(stage.procedure, instrument, artefacts, 1)
    try:
        AcceptanceSession.start(
            path, stage, digest, BEGIN, temperature=room(celsius), who="tester", **given  # type: ignore[arg-type]
        )  # fmt: skip
    except OcmmError as error:
        assert not path.exists()  # nothing was begun
        return error.what
    return ""


def _changed(role: str, **changes: object) -> tuple[UsedArtefact, ...]:
    use = changes.pop("use", {})
    assert isinstance(use, dict)
    return tuple(
        msgspec.structs.replace(one, use=msgspec.structs.replace(one.use, **use), **changes)
        if one.role == role
        else one
        for one in ARTEFACTS
    )


def expired(path: Path, rng: np.random.Generator) -> str:
    due = (BEGIN - timedelta(days=int(rng.integers(1, 900)))).isoformat()
    name = str(rng.choice(_LENGTH))
    return _begin(path, name, _changed("bar", use={"due_utc": due}))


def too_coarse(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "LENGTH-7x5", _changed("bar", expanded=float(rng.uniform(0.015, 1.0))))


def sphere_too_coarse(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "SPHERE-25", _changed("sphere", expanded=float(rng.uniform(0.014, 1.0))))


def sphere_form(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "SPHERE-25", _changed("sphere", form=float(rng.uniform(0.017, 0.1))))


def sphere_size(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "SPHERE-25", _changed("sphere", sizes=(float(rng.uniform(52.0, 90.0)),)))


def calibration_artefact(path: Path, rng: np.random.Generator) -> str:
    bar = ARTEFACTS[0].use
    written = str(rng.choice(["bar-1", "BAR 1", "Bar-1 "]))
    known = msgspec.structs.replace(bar, serial=written)
    return _begin(path, str(rng.choice(_LENGTH)), earlier=EarlierUse(calibration=(known,)))


def calibration_certificate(path: Path, rng: np.random.Generator) -> str:
    digest = f"{int(rng.integers(1 << 60)):064x}"
    known = msgspec.structs.replace(ARTEFACTS[0].use, serial="other", certificate_sha256=digest)
    artefacts = _changed("bar", use={"certificate_sha256": digest})
    return _begin(path, "LENGTH-7x5", artefacts, earlier=EarlierUse(calibration=(known,)))


def qualification_sphere(path: Path, rng: np.random.Generator) -> str:
    name = str(rng.choice(["SPHERE-25", "LOCATION-5x5", "EFFECTIVE-DIAMETER", "THESIS-BALL"]))
    return _begin(path, name, earlier=EarlierUse(qualification=(ARTEFACTS[1].use,)))


def too_warm(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "SPAT", celsius=float(rng.uniform(30.1, 45.0)))


def certificate_range(path: Path, rng: np.random.Generator) -> str:
    artefacts = _changed("bar", temperatures=(19.0, 21.0))
    return _begin(path, "LENGTH-7x5", artefacts, celsius=float(rng.uniform(21.5, 29.0)))


def not_valid(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, "SPAT", status=str(rng.choice(["SUSPECT", "EXPIRED", "FAILED", ""])))


def missing_artefact(path: Path, rng: np.random.Generator) -> str:
    return _begin(path, str(rng.choice(["LENGTH-7x5", "SPHERE-25", "INTERIM", "THESIS-PLATE"])), ())


def too_few_nests(path: Path, rng: np.random.Generator) -> str:
    sizes = (0.0, *np.sort(rng.uniform(50.0, 350.0, 3)).tolist(), 400.0)
    return _begin(path, str(rng.choice(_LENGTH)), _changed("bar", sizes=sizes))


def bar_too_short(path: Path, rng: np.random.Generator) -> str:
    sizes = tuple(np.linspace(0.0, rng.uniform(100.0, 360.0), 6).tolist())
    return _begin(path, str(rng.choice(_LENGTH)), _changed("bar", sizes=sizes))


def _moved_line(path: Path, rng: np.random.Generator, move: Callable[..., object]) -> str:
    """Move a line and return the reason for its repetition; its points are discarded."""
    session, machine = begin(path, "LENGTH-7x5", seed=int(rng.integers(99))), Machine()
    for _ in range(6 * int(rng.integers(1, 3))):
        machine.step(session)
    # The last lines only fill up with new directions; a corner is missed by one that serves it.
    while session.view.next_item or not session.view.positions[session.view.current].corners:
        machine.step(session)
    view = session.view
    position = view.positions[view.current]
    hint = ""
    session.note_temperature(ROOM, machine.now)
    for tip in np.asarray(move(session, position)):
        hint = session.record_point(tip, machine.now)
    assert session.view.done[view.current] == 0 or not hint
    return hint


def missing_corner(path: Path, rng: np.random.Generator) -> str:
    def inward(_session: AcceptanceSession, position: object) -> object:
        points = np.array(position.points_world)  # type: ignore[attr-defined]
        centre = points[[0, -1]].mean(axis=0)
        step = -centre / max(np.linalg.norm(centre), 1e-9)
        if np.linalg.norm(centre) < 1.0:
            step = np.sign(points[0]) * -np.ones(3) / np.sqrt(3.0)
        return points + 70.0 * step

    return _moved_line(path, rng, inward)


def duplicate_direction(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "E0-105", seed=int(rng.integers(99))), Machine()
    for _ in range(18):
        machine.step(session)
    first, second = session.view.positions[0], session.view.positions[1]
    one, other = (np.array(each.points_world) for each in (first, second))
    session.note_temperature(ROOM, machine.now)
    along = (one[-1] - one[0]) / np.linalg.norm(one[-1] - one[0])
    # It begins at its planned place, or within 75 mm of it, and lies along the first line.
    steps = np.linalg.norm(other - other[0], axis=1)
    hint = ""
    for nest in np.tile(steps, 3):
        try:
            hint = session.record_point(other[0] + nest * along, machine.now)
        except OcmmError as error:
            return error.what
    return hint


def outside_volume(path: Path, rng: np.random.Generator) -> str:
    return _moved_line(
        path, rng,
        lambda _s, position: np.array(position.points_world)
        + 40.0 * np.sign(np.array(position.points_world)[0]),
    )  # fmt: skip


def _refused(session: AcceptanceSession, machine: Machine, tip: object) -> str:
    before = session.view
    with pytest.raises(OcmmError) as error:
        session.record_point(np.asarray(tip, dtype=np.float64), machine.now)
    after = session.view
    assert after.done == before.done
    return error.value.what


def wrong_nest(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "LENGTH-7x5"), Machine()
    for _ in range(int(rng.integers(1, 5))):
        machine.step(session)
    position = session.view.positions[0]
    return _refused(session, machine, position.points_world[session.view.next_item + 1])


def off_place(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPHERE-25"), Machine()
    away = rng.standard_normal(3)
    point = np.array(session.view.positions[0].points_world[0])
    return _refused(session, machine, point + 120.0 * away / np.linalg.norm(away))


def not_a_number(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine()
    bad = float(rng.choice([np.nan, np.inf, -np.inf, 1e9]))
    return _refused(session, machine, [bad, 0.0, 0.0])


def same_point_twice(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPHERE-25"), Machine()
    count = int(rng.integers(1, 20))
    for _ in range(count):
        machine.step(session)
    before = np.array(session.view.positions[0].points_world[int(rng.integers(count))])
    return _refused(session, machine, before)


def cone_moved(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine()
    machine.step(session)
    point = np.array(session.view.positions[0].points_world[0])
    return _refused(session, machine, point + np.array([0.0, 0.0, rng.uniform(3.0, 40.0)]))


def calibration_spots(path: Path, rng: np.random.Generator) -> str:
    spots = tuple(((float(a), float(b)),) for a, b in rng.uniform(0.0, 1000.0, (3, 2)))
    stage, digest = stage_of("SPAT")
    session = AcceptanceSession.start(
        path,
        stage,
        digest,
        BEGIN,
        temperature=ROOM,
        who="tester",
        earlier=EarlierUse(spots=(spots_hash(spots),)),
    )
    with pytest.raises(OcmmError) as error:
        session.record_point(np.array(session.view.positions[0].points_world[0]), BEGIN, uv=spots)
    assert session.view.done[0] == 0
    return error.value.what


def spots_twice(path: Path, rng: np.random.Generator) -> str:
    spots = tuple(((float(a), float(b)),) for a, b in rng.uniform(0.0, 1000.0, (3, 2)))
    session = begin(path, "SPAT")
    point = np.array(session.view.positions[0].points_world[0])
    session.record_point(point, BEGIN, uv=spots)
    with pytest.raises(OcmmError) as error:
        session.record_point(point, BEGIN, uv=spots)
    return error.value.what


def near_pole(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPHERE-25"), Machine()
    position = session.view.positions[0]
    centre = np.array(position.points_world[0]) - 18.0 * np.array(position.normals[0])
    hint = ""
    for normal in position.normals:
        low = np.array(normal) + np.array([0.0, 0.0, rng.uniform(2.0, 3.0)])
        machine.now += timedelta(seconds=5)
        hint = session.record_point(centre + 18.0 * low / np.linalg.norm(low), machine.now)
    return hint


def another_sphere(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPHERE-25"), Machine()
    position = session.view.positions[0]
    centre = np.array(position.points_world[0]) - 18.0 * np.array(position.normals[0])
    reach, hint = 18.0 + float(rng.uniform(1.0, 5.0)), ""
    for normal in position.normals:
        hint = session.record_point(centre + reach * np.array(normal), machine.now)
    return hint


def wrong_attitude(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "LOCATION-5x5"), Machine()
    position = session.view.positions[0]
    handle = -np.array(position.handle) if rng.random() < 0.5 else np.array([1.0, 0.0, 0.0])
    hint = ""
    for point in position.points_world:
        hint = session.record_point(np.array(point), machine.now, handle=handle)
    return hint


def probe_not_turned(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine(sigma=0.001)
    hint = ""
    for point in session.view.positions[0].points_world:
        lean = np.array([0.1 * rng.uniform(-1, 1), 0.1 * rng.uniform(-1, 1), 1.0])
        hint = session.record_point(
            np.array(point), machine.now, handle=lean / np.linalg.norm(lean)
        )
    return hint


def third_retest(path: Path, rng: np.random.Generator) -> str:
    session = begin(path, "SPAT", retests_allowed=int(rng.integers(0, 3)))
    machine = Machine(seed=int(rng.integers(1 << 30)), sigma=0.08)
    machine.run(session)
    while session.view.retests_left:
        session.retest(machine.now)
        machine.run(session)
    with pytest.raises(OcmmError) as error:
        session.retest(machine.now)
    return error.value.what


def nothing_failed(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine(seed=int(rng.integers(1 << 30)), sigma=0.001)
    machine.run(session)
    with pytest.raises(OcmmError) as error:
        session.retest(machine.now)
    return error.value.what


def two_lines_failed(path: Path, rng: np.random.Generator) -> str:
    session = begin(path, "LENGTH-7x5")
    which = rng.choice(7, size=int(rng.integers(2, 6)), replace=False)
    names = [session.view.positions[int(one)].name for one in which]
    machine = Machine(per_position=dict.fromkeys(names, 1.0 + 3e-4))
    machine.run(session)
    with pytest.raises(OcmmError) as error:
        session.retest(machine.now)
    assert session.finish(machine.now, ROOM).verdict is AcceptanceVerdict.FAIL
    return error.value.what


def finish_early(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine()
    for _ in range(int(rng.integers(0, 29))):
        machine.step(session)
    with pytest.raises(OcmmError) as error:
        session.finish(machine.now, ROOM)
    return error.value.what


def after_the_verdict(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine(sigma=0.001)
    machine.run(session)
    session.finish(machine.now, ROOM)
    return _refused(session, machine, rng.uniform(-50.0, 50.0, 3))


def drift(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine(sigma=0.001)
    machine.run(session)
    record = session.finish(
        machine.now, room(20.0 + float(rng.choice([-1, 1]) * rng.uniform(1.1, 5.0)))
    )
    assert record.verdict is AcceptanceVerdict.VOID
    return record.void_reasons[0]


def no_temperature(path: Path, rng: np.random.Generator) -> str:
    session, machine = begin(path, "SPAT"), Machine(seed=int(rng.integers(99)))
    for _ in range(10):
        machine.step(session)
    return _refused(session, machine, session.view.positions[1].points_world[0])


VIOLATIONS: tuple[Violation, ...] = (
    expired, too_coarse, sphere_too_coarse, sphere_form, sphere_size, calibration_artefact,
    calibration_certificate, qualification_sphere, too_warm, certificate_range, not_valid,
    missing_artefact, too_few_nests, bar_too_short, missing_corner, duplicate_direction,
    outside_volume, wrong_nest, off_place, not_a_number, same_point_twice, cone_moved,
    calibration_spots, spots_twice, near_pole, another_sphere, wrong_attitude, probe_not_turned,
    third_retest, nothing_failed, two_lines_failed, finish_early, after_the_verdict, drift,
    no_temperature,
)  # fmt: skip


@pytest.mark.parametrize("number", range(200))
def test_a_violation_is_refused_with_a_sentence(number: int, tmp_path: Path) -> None:
    violation = VIOLATIONS[number % len(VIOLATIONS)]
    said = violation(tmp_path / "session", np.random.default_rng([7, number]))
    assert said, violation.__name__
    assert len(said.split()) >= 4
    assert said[0].isupper() or said[0] in "'0123456789-/"
    assert said.endswith(".")
