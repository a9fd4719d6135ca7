"""A job that another program holds: who it is, in words."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.storage import JobFile, JobHead

_HOLD = """
import sys
from pathlib import Path
from ocmm_core.storage import JobFile
job = JobFile.open(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.readline()
job.close()
"""


def test_who_holds_a_job_is_said_and_nobody_else(tmp_path: Path, head: JobHead) -> None:
    path = tmp_path / "held.ocmm"
    JobFile.create(path, head).close()
    assert HOST.holder_of(path) == ""
    with subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        text=True,
    ) as other:  # fmt: skip
        assert other.stdout is not None
        assert other.stdin is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(StorageError) as raised:
            JobFile.open(path)
        held = HOST.holder_of(path)
        other.stdin.write("\n")
        other.stdin.flush()
    assert raised.value.code == "job.locked"
    if held:
        # Without an answer of the system (another name space) the sentence ends before it.
        assert f"process {other.pid}" in held
        assert held in raised.value.what
    assert HOST.holder_of(path) == ""
    # A program gets no warning about its own job.
    with JobFile.open(path):
        assert HOST.holder_of(path) == ""
