from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Ocmm = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def ocmm(tmp_path: Path) -> Ocmm:
    """Return a function that runs the real command line in a process, in a folder of its own."""

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "ocmm_core.cli", *map(str, arguments)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=55,
            check=False,
        )

    return run
