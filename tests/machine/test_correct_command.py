"""`ocmm correct` from a job file to the file for the control, and back."""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile, make_head
from tests.commands import Ocmm
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench, bench, quick_touches  # noqa: F401 - fixtures
from tests.machine.cut_parts import document_file

Measure = Callable[..., Path]
TOOL = "--dialect", "fanuc", "--by", "tester"


@pytest.fixture
def measure(bench: Bench) -> Measure:  # noqa: F811 - the fixture
    """Return a function that measures the quick plan with calibrated cameras and probe."""

    def run(
        name: str, *, simulated: bool = False, state: str = "VALID", unproven: str = "",
        touches: int | None = None,
    ) -> Path:  # fmt: skip
        path, document = bench.folder / f"{name}.ocmm", bench.folder / "plan.toml"
        text = PLAN.read_text(encoding="utf-8")
        # The part has its nominal size, and the plan states another one.
        text = text.replace("nominal = 20.34", "nominal = 20.28")
        document.write_text(text, encoding="utf-8")
        head = make_head(plan=document, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
        with JobFile.create(path, head) as job:
            session = InspectionSession(
                load_plan(document), bench.rig, bench.body, job, SessionOptions()
            )
            session.conditions.note_origin(simulated=simulated)
            session.conditions.note_calibration(f"{state} RIG", f"{state} PROBE", unproven)
            for touch in bench.touches[:touches]:
                session.touches.record_touch(touch)
        return path

    return run


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """Return a document: the step is corrected by a tool's length, the ball by its radius."""
    return document_file(
        tmp_path,
        [{"name": "H3", "kind": "length", "number": 3, "dead_band": 0.001, "present": 0.012},
         {"name": "D3", "kind": "radius", "number": 3, "dead_band": 0.001}],
        [{"characteristic": "Block step", "offsets": ["H3"], "acts": "position",
          "direction": "+Z"},
         {"characteristic": "Ball diameter", "offsets": ["D3"], "acts": "outer"}],
    )  # fmt: skip


@pytest.fixture
def correct(ocmm_here: Ocmm, tmp_path: Path) -> Ocmm:
    def run(*arguments: str | Path) -> object:
        return ocmm_here("correct", *arguments, "--records", tmp_path / "records")

    return run  # type: ignore[return-value]


def _preview(correct: Ocmm, job: Path, plan: Path, *more: str) -> dict[str, object]:
    done = correct("preview", job, plan, "--json", *more)
    assert done.returncode == 0, done.stderr
    found: dict[str, object] = json.loads(done.stdout)
    return found


def test_a_job_corrects_once_and_is_undone(
    measure: Measure, plan: Path, correct: Ocmm, ocmm_here: Ocmm, tmp_path: Path
) -> None:
    job = measure("good")
    shown = correct("preview", job, plan)
    assert "Block step" in shown.stdout, shown.stdout + shown.stderr
    (tmp_path / "shown.txt").write_text(shown.stdout)
    found = _preview(correct, job, plan)
    assert found["refusals"] == []
    assert not (tmp_path / "records").exists()
    wrong = correct("write", job, plan, *TOOL, "--out", tmp_path / "a.nc", "--confirm", "0" * 8)
    assert wrong.returncode == 2
    nobody = correct("write", job, plan, *TOOL, "--out", tmp_path / "a.nc")
    assert "No person has confirmed" in nobody.stderr
    assert not (tmp_path / "records").exists()
    code = str(found["code"])
    done = correct("write", job, plan, *TOOL, "--out", tmp_path / "a.nc", "--confirm", code)
    assert done.returncode == 0, done.stderr
    first = (tmp_path / "a.nc").read_text(encoding="ascii")
    assert "G90 G10 L11 P3 R" in first or "G90 G10 L13 P3 R" in first
    # The same job again: the same values, and nothing more in the register.
    again = correct("write", job, plan, *TOOL, "--out", tmp_path / "b.nc", "--confirm", code)
    assert "recorded before" in again.stdout, again.stderr
    assert (tmp_path / "b.nc").read_text(encoding="ascii") == first
    assert correct("history", plan).stdout.count("corrected") == 1
    # The job says it, too, once and signed; the archive has it with the job.
    with JobFile.read(job) as file:
        stated = [one.text for one in file.events() if one.kind == "corrected"]
        assert not file.seal().doubts
        content = file.content()
    (text,) = stated
    assert "by tester" in text
    assert "H3 0.012 → " in text
    table = ocmm_here("archive", "export", "archived_job", tmp_path / "jobs.csv")
    assert table.returncode == 0, table.stderr
    assert hashlib.sha256(content).hexdigest() in (tmp_path / "jobs.csv").read_text()
    taken = correct("write", job, plan, *TOOL, "--out", tmp_path / "b.nc", "--confirm", code)
    assert taken.returncode == 2
    # Another job of the same serial number would count the error twice.
    second = measure("second")
    refused = _preview(correct, second, plan)
    assert "--recut" in str(refused["refusals"])
    assert _preview(correct, second, plan, "--recut")["changes"]
    back = correct("undo", plan, *TOOL, "--out", tmp_path / "c.nc", "--reason", "trial")
    assert back.returncode == 0, back.stderr
    old = [one.split("R")[-1] for one in (tmp_path / "c.nc").read_text().split("\n")
           if one.startswith("G90 G10 L11")]  # fmt: skip
    assert old in (["0.012"], [])
    # Another document may not contain all its offsets.
    text = plan.read_text(encoding="utf-8")
    plan.write_text(text + "# another one\n", encoding="utf-8")
    other = correct("undo", plan, *TOOL, "--out", tmp_path / "d.nc", "--reason", "trial")
    assert "another document" in other.stderr
    plan.write_text(text, encoding="utf-8")
    undone = correct("undo", plan, *TOOL, "--out", tmp_path / "d.nc", "--reason", "trial")
    assert undone.returncode == 0, undone.stderr
    assert (tmp_path / "d.nc").read_bytes() == (tmp_path / "c.nc").read_bytes()
    assert correct("history", plan).stdout.count("undone") == 1
    assert _preview(correct, job, plan)["changes"] == found["changes"]


def test_values_read_from_the_control(measure: Measure, plan: Path, correct: Ocmm) -> None:
    job = measure("before")
    assert correct("set", plan, "H3=0.1", "--by", "tester").returncode == 0
    for wrong in ("H3", "H3=x", "H4=1", "H3=9000", "H3=nan", "H3=inf", "H3=0.0125"):
        assert correct("set", plan, wrong, "--by", "tester").returncode == 2
    # It was cut with another length.
    assert "before the control had" in str(_preview(correct, job, plan)["refusals"])
    changes = _preview(correct, measure("after"), plan)["changes"]
    assert isinstance(changes, list)
    assert changes[0]["before"] == 0.1


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"simulated": True}, "SIMULATED"),
        ({"state": "EXPIRED"}, "EXPIRED"),
        ({"state": "SUSPECT"}, "SUSPECT"),
        ({"state": "NONE"}, "NONE"),
        ({"state": "DESIGN"}, "DESIGN"),
        ({"unproven": "Measured as uncalibrated."}, "UNCALIBRATED"),
        ({"touches": 10}, "INCOMPLETE"),
    ],
)
def test_a_job_without_proof_corrects_nothing(
    how: dict[str, object], why: str, measure: Measure, plan: Path, correct: Ocmm, tmp_path: Path
) -> None:
    job = measure("bad", **how)
    found = _preview(correct, job, plan)
    assert why in str(found["refusals"])
    assert found["changes"] == found["effects"] == []
    done = correct(
        "write", job, plan, *TOOL, "--out", tmp_path / "a.nc", "--confirm", str(found["code"])
    )
    assert done.returncode == 1
    assert not (tmp_path / "a.nc").exists()
    assert not (tmp_path / "records").exists()


def test_an_altered_job_corrects_nothing(
    measure: Measure, plan: Path, correct: Ocmm, tmp_path: Path
) -> None:
    job = measure("good")
    altered = tmp_path / "altered.ocmm"
    shutil.copy(job, altered)
    with sqlite3.connect(altered) as db:
        (table,) = db.execute(
            "SELECT name FROM sqlite_master WHERE type='trigger' AND tbl_name='event' LIMIT 1"
        ).fetchone() or ("",)
        for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type='trigger'").fetchall():
            db.execute(f"DROP TRIGGER {name}")
        changed = db.execute("UPDATE event SET text = text || ' '").rowcount
    db.close()
    assert changed, table
    done = correct("preview", altered, plan, "--json")
    if done.returncode == 0:
        found = json.loads(done.stdout)
        assert found["refusals"]
        assert found["changes"] == []


def test_practice_is_marked_and_loads_nothing(
    measure: Measure, plan: Path, correct: Ocmm, tmp_path: Path
) -> None:
    job = measure("simulated", simulated=True, state="DESIGN")
    found = _preview(correct, job, plan, "--practice")
    assert found["practice"]
    assert found["changes"]
    done = correct(
        "write", job, plan, *TOOL, "--practice", "--out", tmp_path / "a.nc", "--confirm",
        str(found["code"]),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "a.nc").read_text(encoding="ascii").splitlines()
    assert "PRACTICE" in lines[0]
    assert all(line[0] == "(" and line[-1] == ")" for line in lines)
    # It is not in the register of the machine.
    assert "corrected" not in correct("history", plan).stdout
    assert "corrected" in correct("history", plan, "--practice").stdout


def test_an_altered_register_is_refused(
    measure: Measure, plan: Path, correct: Ocmm, tmp_path: Path
) -> None:
    assert correct("set", plan, "H3=0.1", "--by", "tester").returncode == 0
    assert correct("set", plan, "H3=0.2", "--by", "tester").returncode == 0
    register = tmp_path / "records" / "VMC 3.jsonl"
    whole = register.read_bytes()
    job = measure("good")
    lines = whole.splitlines(keepends=True)
    unsigned = [json.loads(line) | {"signature": None} for line in lines]
    for forged in (
        whole.replace(b'"H3":0.2', b'"H3":0.3'), lines[0], b"",
        b"".join(json.dumps(one).encode() + b"\n" for one in unsigned),
    ):  # fmt: skip
        register.write_bytes(forged)
        if forged:
            assert correct("preview", job, plan).returncode == 2
    register.write_bytes(whole)
    assert correct("preview", job, plan).returncode == 0


def test_a_job_that_cannot_be_written_corrects_nothing(
    measure: Measure, plan: Path, correct: Ocmm, tmp_path: Path
) -> None:
    job = measure("held")
    code = str(_preview(correct, job, plan)["code"])
    with JobFile.open(job):
        held = correct("write", job, plan, *TOOL, "--out", tmp_path / "a.nc", "--confirm", code)
    assert held.returncode != 0
    assert "another program" in held.stderr
    assert not (tmp_path / "a.nc").exists()
    assert "corrected" not in correct("history", plan).stdout
    done = correct("write", job, plan, *TOOL, "--out", tmp_path / "a.nc", "--confirm", code)
    assert done.returncode == 0, done.stderr
