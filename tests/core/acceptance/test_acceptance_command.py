from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


def _ocmm(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ocmm_core.cli", "acceptance", *words],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_a_test_runs_from_frames_to_a_record_that_recomputes_from_its_spots(tmp_path: Path) -> None:
    ran = _ocmm("run", "EFFECTIVE-DIAMETER", "--folder", str(tmp_path))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "SIMULATED" in ran.stdout
    assert "modelled on" in ran.stdout
    (record,) = (tmp_path / "records").glob("*.json")
    again = _ocmm("recompute", str(record), "--spots")
    assert again.returncode == 0, again.stdout + again.stderr
    assert "matches the file" in again.stdout
    record.write_bytes(record.read_bytes().replace(b'"PASS"', b'"FAIL"', 1))
    assert _ocmm("recompute", str(record)).returncode == 2


@pytest.mark.slow
def test_a_procedure_that_does_not_exist_is_named() -> None:
    wrong = _ocmm("plan", "LENGTH-8")
    assert wrong.returncode == 2
    assert "LENGTH-7x5" in wrong.stderr
