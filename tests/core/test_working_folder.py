"""Files of the working folder are neither code nor options of a program that is started there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.host import HANG_S

_OCMM = "import sys; sys.path.remove(''); from ocmm_cli import main; main()"
_DOORS = {
    "command": ["-c", _OCMM, "--version"],
    "window by the command": ["-c", _OCMM, "demo", "--source", "nothing"],
    "window": ["-c", _OCMM, "window", "--help"],
}
_SPAWN = """
import sys
sys.path.remove('')
import multiprocessing, os
if __name__ == "__main__":
    from ocmm_core.side_files import distrust_working_folder
    distrust_working_folder()
    child = multiprocessing.get_context("spawn").Process(target=os.getpid)
    child.start()
    child.join()
"""


def _run(folder: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False,
        timeout=HANG_S, env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
    )  # fmt: skip


@pytest.mark.parametrize("door", [*_DOORS, "spawned process"])
def test_no_module_of_the_working_folder_is_loaded(tmp_path: Path, door: str) -> None:
    # The window of a folder of jobs loaded `multiprocessing` from there.
    for name in ("multiprocessing", "PySide6", "msgspec", "platformdirs", "pickle", "typer"):
        (tmp_path / f"{name}.py").write_text("open('loaded', 'w').write(__name__)\n")
    done = _run(tmp_path, _DOORS.get(door, ["-c", _SPAWN]))
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "loaded").exists()


@pytest.mark.parametrize("door", ["command", "window"])
@pytest.mark.parametrize("kind", ["file", "pipe"])
def test_options_for_numba_are_refused(tmp_path: Path, door: str, kind: str) -> None:
    path = tmp_path / ".numba_config.yaml"
    if kind == "file":
        path.write_text("disable_jit: 1\n")
    else:
        os.mkfifo(path)
    done = _run(tmp_path, _DOORS[door])
    assert done.returncode == 2
    assert "changes how numbers are computed" in done.stderr
