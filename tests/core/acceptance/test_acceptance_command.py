from __future__ import annotations

from pathlib import Path

import pytest

from tests.commands import Ocmm


@pytest.mark.slow
def test_a_test_runs_from_frames_to_a_record_that_recomputes_from_its_spots(
    ocmm_here: Ocmm, calm_rig: Path, tmp_path: Path
) -> None:
    ran = ocmm_here(
        "acceptance", "run", "EFFECTIVE-DIAMETER", "--rig", calm_rig, "--folder", tmp_path
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "SIMULATED" in ran.stdout
    assert "modelled on" in ran.stdout
    (record,) = (tmp_path / "records").glob("*.json")
    again = ocmm_here("acceptance", "recompute", record, "--spots")
    assert again.returncode == 0, again.stdout + again.stderr
    assert "matches the file" in again.stdout
    record.write_bytes(record.read_bytes().replace(b'"PASS"', b'"FAIL"', 1))
    assert ocmm_here("acceptance", "recompute", record).returncode == 2


def test_a_procedure_that_does_not_exist_is_named(ocmm_here: Ocmm) -> None:
    wrong = ocmm_here("acceptance", "plan", "LENGTH-8")
    assert wrong.returncode == 2
    assert "LENGTH-7x5" in wrong.stderr
