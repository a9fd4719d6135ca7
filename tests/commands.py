"""Commands of `ocmm`, in separate processes or in that of the test."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_cli import main
from tests.host import HANG_S
from tests.slow_rig import CALM_HZ, slow_rig_in

Ocmm = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def ocmm(tmp_path: Path) -> Ocmm:
    """Return a function that runs the real command line in a process, in a separate folder."""

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "ocmm_cli", *map(str, arguments)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=HANG_S,
            check=False,
        )

    return run


@pytest.fixture
def ocmm_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Ocmm:
    """Return the same in this process: two seconds less each for what needs no process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO())

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        command = ["ocmm", *map(str, arguments)]
        monkeypatch.setattr(sys, "argv", command)
        capfd.readouterr()
        code: str | int | None = 0
        try:
            main()
        except SystemExit as end:
            code = end.code
        out, err = capfd.readouterr()
        return subprocess.CompletedProcess(command, int(code or 0), out, err)

    return run


@pytest.fixture
def slow_rig(tmp_path: Path) -> Path:
    """Return the recommended rig with an eighth of the frames, where speed does not matter."""
    return slow_rig_in(tmp_path)


@pytest.fixture
def calm_rig(tmp_path: Path) -> Path:
    """Return the same with a quarter of them, for steps that need frames of a resting ball."""
    return slow_rig_in(tmp_path, CALM_HZ)
