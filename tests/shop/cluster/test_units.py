"""The units of systemd that are copied: systemd reads them, and their programs know the options."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_cli import app
from tests.host import HANG_S, needs_package, not_run

LINUX = Path(__file__).resolve().parents[3] / "installer" / "linux"
UNITS = ("ocmm-scheduler.service", "ocmm-workers.service", "ocmm-archive.service")


@pytest.mark.parametrize("name", UNITS)
def test_systemd_takes_a_unit(name: str, tmp_path: Path) -> None:
    needs_package("distributed", "extra `shop`")
    program = shutil.which("systemd-analyze")
    if program is None:
        not_run("'systemd-analyze' is not installed (Debian: apt-get install systemd)")
    here = Path(sys.executable).parent
    unit = tmp_path / name
    text = (LINUX / name).read_text("utf-8")
    assert "/opt/ocmm/.venv/bin/" in text
    unit.write_text(text.replace("/opt/ocmm/.venv/bin", str(here)), "utf-8")
    done = subprocess.run(
        [program, "verify", unit], capture_output=True, text=True, timeout=HANG_S, check=False
    )
    said = [line for line in (done.stdout + done.stderr).splitlines() if name in line]
    assert said == []


@pytest.mark.parametrize("name", UNITS)
def test_a_program_knows_the_options_of_its_unit(name: str) -> None:
    """Options that a later Dask drops would end the service at its start."""
    needs_package("distributed", "extra `shop`")
    text = (LINUX / name).read_text("utf-8").replace("\\\n", " ")
    (line,) = [one for one in text.splitlines() if one.startswith("ExecStart=")]
    words = line.removeprefix("ExecStart=").split()
    options = [word for word in words if word.startswith("--")]
    if words[0].endswith("/ocmm"):
        from typer.main import get_command

        group = get_command(app)
        archive = group.commands["archive"]  # type: ignore[attr-defined]
        known = [one for param in archive.commands["send"].params for one in param.opts]
    else:
        from distributed.cli import dask_scheduler, dask_worker

        command = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}[words[1]]
        known = [one for param in command.params for one in (*param.opts, *param.secondary_opts)]
    assert set(options) <= set(known)
