"""Commands print on terminals of any encoding, and say what is saved only where it is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from tests.host import HANG_S

ENCODINGS = {"latin-1": "Ø", "cp850": "Ø", "ascii": "O"}
"""A sign that two of them have; none has a Chinese one."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished job."""
    folder = tmp_path_factory.mktemp("encodings")
    request = StationRequest(plan=resource("plans", "quick.toml"), out=folder, frame_rate_hz=500)
    built = build_station(request)
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
    finally:
        built.station.close()
    return built.job_path


_ALL = """
import contextlib, io, os, sys
from ocmm_core.cli import _entry
job, folder = sys.argv[1:3]
points = os.path.join(folder, "points Ø 中.csv")
if not os.path.exists(points):
    with open(points, "w") as stream:
        stream.write("# unit: mm\\nx,y,z\\n0,0,0\\n10,0,0.01\\n0,10,0\\n10,10,0.02\\n5,5,0\\n")
fit = ["fit", "--shape", "plane"]
some = sys.argv[3] == "some"
for arguments in (
    [*fit, points], ["uncertainty", job], ["align", job], ["recall", job], ["compare", job],
    ["audit", "verify", job], ["environment", job], ["report", "--help"], ["calibrate", "status"],
    ["probe", "uncertainty"], [*fit, points + ".gone"], ["--language", "de", "uncertainty", job],
    ["--language", "de", *fit, points], ["--language", "de", "measure", "--help"],
)[:: 6 if some else 1]:
    sys.argv = ["ocmm", *arguments]
    code = 0
    try:
        _entry.main()
    except SystemExit as end:
        code = end.code or 0
    print("CODE", code, *arguments)
"""


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_command_that_prints_tables_prints_them(
    encoding: str, job: Path, tmp_path: Path
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _ALL, str(job), str(tmp_path), "all" if encoding == "ascii" else "some"],
        capture_output=True, timeout=HANG_S, check=False, cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": encoding},
    )  # fmt: skip
    out = done.stdout.decode(encoding)
    error = done.stderr.decode(encoding)
    assert done.returncode == 0, error
    codes = [line.split()[1] for line in out.splitlines() if line.startswith("CODE")]
    assert len(codes) == (14 if encoding == "ascii" else 3)
    # 3 is a failure of the program.
    assert "3" not in codes, error
    assert "UnicodeEncodeError" not in error
    assert "All points taken" not in error
    assert f"points {ENCODINGS[encoding]} \\u4e2d.csv" in out
