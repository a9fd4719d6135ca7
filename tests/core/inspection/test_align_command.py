"""``ocmm align``: the alignment of a job is shown, and its frame saved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from ocmm_cli import app
from ocmm_core.alignment import SavedFrame, frame_document, load_frame, save_frame, simulated_frame
from ocmm_core.errors import InputError
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, make_head
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench

DATUMS = '[alignment]\ntype = "datum reference frame"\ndatums = ["BED", "SPHERE"]\n'
SAVED = """
[alignment]
type = "saved frame"
name = "bed"
digest = ""
rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
translation = [1.0, 2.0, 3.0]
"""


def _job(bench: Bench, alignment: str) -> Path:
    path = bench.folder / "aligned.toml"
    path.write_text(PLAN.read_text() + "\n" + alignment)
    head = make_head(plan=path, rig=RIG, probe=PROBE, operator="me", part="P", serial="7")
    with JobFile.create(bench.folder / "job.ocmm", head) as job:
        session = InspectionSession(load_plan(path), bench.rig, bench.body, job, SessionOptions())
        for touch in bench.touches:
            assert isinstance(session.touches.record_touch(touch), MeasuredPoint)
    return bench.folder / "job.ocmm"


def _align(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["align", *map(str, arguments)])


def test_residuals_and_what_is_open_are_shown(bench: Bench) -> None:
    job = _job(bench, DATUMS)
    shown = _align(job)
    assert shown.exit_code == 0, shown.output
    assert "Frame: part frame of BED|SPHERE" in shown.output
    assert "Open degrees of freedom: rotation about z" in shown.output
    assert "U (k=2) of the origin" in shown.output
    rows = [line.split() for line in shown.output.splitlines() if line.startswith(("BED", "SPH"))]
    assert [row[0] for row in rows[:2]] == ["BED", "SPHERE"]
    # The virtual part matches its plan, except for the noise of the points.
    assert all(float(row[4]) < 0.05 and 0.0 <= float(row[5]) < 0.05 for row in rows[:2])
    refused = _align(job, "--save", bench.folder / "frame.toml")
    assert isinstance(refused.exception, InputError)
    assert "does not fully constrain the part" in str(refused.exception)


def test_a_frame_is_saved_with_its_control_points(bench: Bench) -> None:
    job, frame = _job(bench, SAVED), bench.folder / "frame.toml"
    shown = _align(job, "--save", frame, "--control", "SPHERE")
    assert shown.exit_code == 0, shown.output
    assert "The frame is used as saved" in shown.output
    document = load_frame(frame)
    assert document.name == "frame"
    assert document.T_frame_from_world.translation == pytest.approx([1.0, 2.0, 3.0])
    (control,) = document.control
    seen = next(item for item in reopen_job(job).view.features if item.name == "SPHERE")
    assert seen.fit is not None
    assert control.feature == "SPHERE"
    assert np.array(control.place) - [1.0, 2.0, 3.0] == pytest.approx(seen.fit.point, abs=1e-9)
    unknown = _align(job, "--save", bench.folder / "b.toml", "--control", "BED")
    assert "BED is not a measured feature with a centre" in str(unknown.exception)


def test_a_plan_takes_a_saved_frame_over(tmp_path: Path) -> None:
    moved = RigidTransform(rotation_from_vector(np.array([0.1, 0.2, -0.3])), np.arange(3.0))
    places = {"SPHERE": np.zeros(3), "A": np.eye(3)[0], "B": np.eye(3)[1]}
    frame = tmp_path / "frame.toml"
    save_frame(frame, frame_document("bed", "2026-01-02", "bed of the mill", moved, places))
    made = _align_plan(PLAN, "--frame", frame, "--out", tmp_path / "plan.toml")
    assert made.exit_code == 0, made.output
    rule = load_plan(tmp_path / "plan.toml").alignment
    assert isinstance(rule, SavedFrame)
    assert rule.digest == load_frame(frame).sha256
    assert np.array_equal(np.array(rule.rotation), moved.rotation)
    # The quick plan has no features A and B.
    refused = _align_plan(
        PLAN, "--frame", frame, "--out", tmp_path / "b.toml", "--relocate", "0.05"
    )
    assert isinstance(refused.exception, InputError)
    assert "names 'A', which is not a feature of the plan" in str(refused.exception)
    assert not (tmp_path / "b.toml").exists()


def test_a_frame_of_a_simulated_job_says_so_wherever_it_goes(bench: Bench) -> None:
    path, frame = _job(bench, SAVED), bench.folder / "frame.toml"
    real = bench.folder / "real.toml"
    assert "SIMULATED" not in _align(path, "--save", real).output
    assert not load_frame(real).simulated
    assert "simulated" not in real.read_text()
    with JobFile.open(path) as job:
        job.append_event("simulated", "Points come from a virtual rig.")
    shown = _align(path, "--save", frame)
    assert "SIMULATED: No real part was measured." in shown.output
    assert load_frame(frame).simulated
    # Nobody takes the word out by hand.
    text = frame.read_text()
    frame.write_text(text.replace("simulated = true\n", ""))
    with pytest.raises(InputError, match="does not match its hash"):
        load_frame(frame)
    frame.write_text(text)
    made = _align_plan(PLAN, "--frame", frame, "--out", bench.folder / "plan.toml")
    assert "SIMULATED: frame frame comes from a virtual rig." in made.output
    assert simulated_frame(load_plan(bench.folder / "plan.toml").alignment) == "frame"


def _align_plan(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["align-plan", *map(str, arguments)])


def test_a_plan_without_alignment_is_told_so(bench: Bench) -> None:
    shown = _align(_job(bench, ""))
    assert isinstance(shown.exception, InputError)
    assert "has no alignment" in str(shown.exception)
