"""A camera built from docs/integrator/camera_objects.md alone passes every rule."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_bench.conform import CameraOutcome, conform
from ocmm_core.fieldbus.device import PRODUCT_CODE, REVISION
from tests.core.fieldbus.conform_lines import TimedLine
from tests.host import HANG_S, private_network
from tests.second_camera.second_camera import SecondCamera
from tests.second_camera.second_firmware import signed

_ROOT = Path(__file__).resolve().parents[3]
_FOLDER = _ROOT / "tests" / "second_camera"
SERIAL = 2001


def test_it_uses_nothing_of_the_program() -> None:
    files = sorted(_FOLDER.glob("*.py"))
    assert len(files) == 5
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not [name for name in names if name.startswith(("ocmm_", "benchmarks"))], file


def test_the_second_camera_is_green() -> None:
    camera = SecondCamera(SERIAL, 21)
    firmware = signed("1.1.0", bytes(range(256)) * 20, PRODUCT_CODE, REVISION)
    report = conform(TimedLine(camera.work_on, camera.idle), firmware=firmware)
    assert not [(each.code, each.complaints) for each in report.results if each.complaints]
    assert report.outcome is CameraOutcome.GREEN
    assert (report.serial, report.firmware) == (SERIAL, "1.1.0")


@pytest.mark.timing
def test_the_second_camera_passes_over_a_virtual_cable(tmp_path: Path) -> None:
    """The command, between two processes and with the clock of this computer."""
    prefix = private_network()
    script = tmp_path / "both.sh"
    script.write_text(
        "set -e\n"
        "ip link add host0 type veth peer name cameras0\n"
        "ip link set host0 up; ip link set cameras0 up\n"
        f"mkfifo '{tmp_path}/end'\n"
        f"'{sys.executable}' -m tests.second_camera.second_camera cameras0 {SERIAL} "
        f"< '{tmp_path}/end' > '{tmp_path}/ready' &\n"
        f"exec 7> '{tmp_path}/end'\n"
        f"while ! grep -q ready '{tmp_path}/ready'; do sleep 0.05; done\n"
        f"'{sys.executable}' -m ocmm_cli camera conform host0 --json '{tmp_path}/r.json' "
        f"--firmware '{tmp_path}/new.fw'\n"
    )
    image = signed("1.1.0", bytes(range(256)) * 20, PRODUCT_CODE, REVISION)
    (tmp_path / "new.fw").write_bytes(image)
    done = subprocess.run(
        [*prefix, "sh", str(script)],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        cwd=_ROOT,
        env={**os.environ, "PATH": f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"},
    )
    # A computer with repeated pauses skips rules, and reports that; none may be broken.
    assert done.returncode in (0, 3), done.stdout + done.stderr
    assert "FAILED" not in done.stdout
    assert f"serial number {SERIAL}" in done.stdout
    if done.returncode == 3:
        assert "This computer paused" in done.stdout
