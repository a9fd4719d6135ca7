"""Jobs that prove nothing correct nothing."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace as changed

from ocmm_core.errors import InputError
from ocmm_core.tolerances.decisions import Verdict
from ocmm_machine import CorrectionDocument, MeasuredValue, PartFacts, propose
from tests.host import amount
from tests.machine.cut_parts import NOON, document, line_of, measured, part

FAULTS = ("unproven verdict", "no value", "suspect", "simulated", "fault", "other plan",
          "within U", "within the dead band", "zone", "no uncertainty", "already", "too few",
          "not cut again")  # fmt: skip
NOT_PROVEN = (Verdict.NOT_PROVEN, Verdict.NOT_MEASURED, Verdict.PROVISIONAL)


@pytest.fixture
def plan(tmp_path: Path) -> CorrectionDocument:
    return _plan(tmp_path)


def _plan(folder: Path, **more: object) -> CorrectionDocument:
    return document(
        folder,
        [{"name": "H1", "kind": "length", "number": 1, "dead_band": 0.005, "step": 0.05},
         {"name": "D1", "kind": "radius", "number": 1, "dead_band": 0.005, "step": 0.05}],
        [{"characteristic": "step", "offsets": ["H1"], "acts": "position", "direction": "+Z"},
         {"characteristic": "bore", "offsets": ["D1"], "acts": "inner"}],
        None, **more,
    )  # fmt: skip


def _good(rng: np.random.Generator, number: int = 1) -> PartFacts:
    values = []
    for name, kind in (("step", "distance"), ("bore", "diameter")):
        u = float(rng.uniform(0.0005, 0.01))
        error = float(rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0) * max(u, 0.006))
        values.append(measured(name, kind, error, u))
    return part(values, number)


def _changed(one: MeasuredValue, **changes: object) -> MeasuredValue:
    return replace(one, result=replace(one.result, **changes))  # type: ignore[arg-type]


def _spoilt(rng: np.random.Generator, good: PartFacts, fault: str) -> PartFacts:
    """Return the job with one fault, of every value or of the whole job."""

    def each(one: MeasuredValue) -> MeasuredValue:
        u = float(rng.uniform(0.006, 0.02))
        match fault:
            case "unproven verdict":
                return _changed(one, verdict=NOT_PROVEN[int(rng.integers(3))])
            case "no value":
                return _changed(one, measured=None, deviation=None, uncertainty=None)
            case "suspect":
                return replace(one, why="Point 3 is SUSPECT.")
            case "within U":
                within = float(rng.uniform(-1.0, 1.0)) * u
                return _changed(one, deviation=within, uncertainty=u)
            case "within the dead band":
                within = float(rng.uniform(-1.0, 1.0)) * 0.005
                return _changed(one, deviation=within, uncertainty=1e-5)
            case "zone":
                return _changed(one, kind="position")
            case "no uncertainty":
                bad = float(rng.choice([0.0, np.nan, np.inf, -0.001]))
                return _changed(one, uncertainty=bad)
        return one

    values = {name: each(one) for name, one in good.values.items()}
    whole: dict[str, dict[str, object]] = {
        "simulated": {"simulated": True}, "fault": {"faults": ("The job is INCOMPLETE.",)},
        "other plan": {"plan": "OTHER"},
    }  # fmt: skip
    return replace(good, values=values, **whole.get(fault, {}))  # type: ignore[arg-type]


def test_no_correction_from_jobs_that_do_not_prove_it(tmp_path: Path) -> None:
    """10,000 generated jobs in the long form; the same jobs without the fault all correct."""
    one, three = _plan(tmp_path), _plan(tmp_path, parts=3)
    rng = np.random.default_rng(46)
    seen: Counter[str] = Counter()
    for _ in range(amount(2000, 10_000)):
        fault = FAULTS[int(rng.integers(len(FAULTS)))]
        good = _good(rng)
        first = propose(one, [good], [])
        assert first.changed, first
        lines = [line_of(first, good.created + timedelta(seconds=5))]
        again = replace(good, uuid="other", created=NOON + timedelta(hours=1))
        match fault:
            case "already":
                found = propose(one, [good], lines, recut=bool(rng.random() < 0.5))
            case "not cut again":
                serial = str(rng.choice([good.serial, "", "-"]))
                found = propose(one, [replace(again, serial=serial)], lines)
            case "too few":
                found = propose(three, [good], [])
            case _:
                found = propose(one, [_spoilt(rng, good, fault)], [])
        assert not found.changed, (fault, found)
        seen[fault] += 1
    assert set(seen) == set(FAULTS)


def test_practice_takes_simulated_jobs_and_nothing_else(plan: CorrectionDocument) -> None:
    rng = np.random.default_rng(1)
    good = _good(rng)
    assert propose(plan, [replace(good, simulated=True)], [], practice=True).changed
    for fault in ("unproven verdict", "suspect", "fault", "other plan", "no uncertainty"):
        spoilt = _spoilt(rng, replace(good, simulated=True), fault)
        assert not propose(plan, [spoilt], [], practice=True).changed


def test_a_recut_part_may_correct_again(plan: CorrectionDocument) -> None:
    good = _good(np.random.default_rng(2))
    lines = [line_of(propose(plan, [good], []), good.created + timedelta(seconds=5))]
    again = replace(good, uuid="other", created=NOON + timedelta(hours=1))
    assert propose(plan, [again], lines, recut=True).changed
    assert propose(plan, [replace(again, serial="S2")], lines).changed


def test_the_step_and_the_limits_hold(plan: CorrectionDocument) -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        size = float(rng.uniform(0.01, 4.0))
        found = propose(plan, [part([measured("step", "distance", size)])], [])
        assert 0.0 < -found.changes[0].change <= 0.05
        assert abs(found.changes[0].change) <= size
    gone = _with_limits(plan, highest=0.02, lowest=-0.02)
    found = propose(gone, [part([measured("step", "distance", 1.0)])], [])
    assert not found.changed
    assert "beyond its limits" in found.refusals[0]


def _with_limits(plan: CorrectionDocument, **limits: float) -> CorrectionDocument:
    """Return the document with other limits of all offsets."""
    return changed(plan, offset=tuple(changed(one, **limits) for one in plan.offset))


def test_a_correction_that_takes_another_out_of_tolerance_is_refused(tmp_path: Path) -> None:
    both = document(
        tmp_path, [{"name": "H1", "kind": "length", "number": 1}],
        [{"characteristic": "a", "offsets": ["H1"], "acts": "position", "direction": "+Z"},
         {"characteristic": "b", "offsets": ["H1"], "acts": "position", "direction": "+Z",
          "weight": 0.0}],
    )  # fmt: skip
    values = [measured("a", "distance", 0.05), measured("b", "distance", 0.0, tolerance=0.02)]
    found = propose(both, [part(values)], [])
    assert not found.changed
    assert found.refusals == ("b would leave its tolerance.",)


def test_offsets_that_cannot_be_told_apart_are_refused(tmp_path: Path) -> None:
    both = document(
        tmp_path,
        [{"name": "H1", "kind": "length", "number": 1},
         {"name": "Z", "kind": "work", "axis": "z", "number": 1}],
        [{"characteristic": "a", "offsets": ["H1", "Z"], "acts": "position", "direction": "+Z"}],
    )  # fmt: skip
    found = propose(both, [part([measured("a", "distance", 0.05)])], [])
    assert not found.changed
    assert "cannot separate the effects of H1, Z." in found.refusals[0]


def test_an_offset_below_its_u_stays_and_the_others_take_its_share(tmp_path: Path) -> None:
    """Two near places hardly prove a rotation: its U is large, and it is left out."""
    work = document(
        tmp_path,
        [{"name": name, "kind": "work", "axis": name.lower(), "number": 1} for name in "XC"],
        [{"characteristic": name, "offsets": ["X", "C"], "acts": "position", "direction": "+X"}
         for name in "ab"],
    )  # fmt: skip
    places = {"a": np.array([0.0, 10.0, 0.0]), "b": np.array([0.0, 12.0, 0.0])}
    values = [measured(name, "coordinate", 0.05 + error, axis="x", feature=name)
              for name, error in (("a", 0.001), ("b", -0.001))]  # fmt: skip
    found = propose(work, [part(values, places=places)], [])
    x, c = found.changes
    assert (x.change, c.change) == (-0.05, 0.0)
    assert c.why == "Not beyond U and the dead band."
    assert c.expanded > 0.1


def test_u_of_a_change_is_that_of_errors_that_go_together(tmp_path: Path) -> None:
    """A mean of ten characteristics with one common error is not better than one."""
    names = [f"c{k}" for k in range(10)]
    many = document(
        tmp_path, [{"name": "H1", "kind": "length", "number": 1}],
        [{"characteristic": name, "offsets": ["H1"], "acts": "position", "direction": "+Z"}
         for name in names],
    )  # fmt: skip
    found = propose(many, [part([measured(name, "distance", 0.05, 0.01) for name in names])], [])
    assert found.changes[0].expanded == pytest.approx(0.01)


def test_after_an_undo_the_same_job_counts_again(plan: CorrectionDocument) -> None:
    good = _good(np.random.default_rng(5))
    found = propose(plan, [good], [])
    first = line_of(found, good.created + timedelta(seconds=5))
    undone = changed(
        first, utc=(good.created + timedelta(minutes=5)).isoformat(), what="undone",
        before=first.after, after=first.before, jobs=(), serials=(), undoes=1,
    )  # fmt: skip
    again = propose(plan, [good], [first, undone])
    assert again.changed == found.changed
    between = replace(good, uuid="x", serial="S9", created=good.created + timedelta(minutes=1))
    assert not propose(plan, [between], [first, undone]).changed


@pytest.mark.parametrize(
    "wrong",
    [{"step": 0.001}, {"share": 0.0}, {"share": 1.5}, {"dead_band": 0.0}, {"present": 6000.0},
     {"axis": "x"}, {"number": 0}, {"present": 0.0004}, {"name": "Länge"}, {"colour": 1}],
)  # fmt: skip
def test_an_unusable_document_is_refused(wrong: dict[str, object], tmp_path: Path) -> None:
    with pytest.raises(InputError):
        document(
            tmp_path, [{"name": "H1", "kind": "length", "number": 1, **wrong}],
            [{"characteristic": "a", "offsets": ["H1"], "acts": "position", "direction": "+Z"}],
        )  # fmt: skip
