"""``ocmm camera`` as a technician types it: a virtual wire in real processes, exit codes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.firmware_updates import firmware
from tests.commands import Ocmm
from tests.host import private_network

VIRTUAL = ("--source", "ethercat:virtual")
pytestmark = pytest.mark.timing


@pytest.fixture(autouse=True)
def virtual() -> None:
    """Need a virtual wire."""
    private_network()


def test_signed_firmware_runs_after_the_command(ocmm: Ocmm, tmp_path: Path) -> None:
    file = tmp_path / "camera.fw"
    file.write_bytes(firmware("2.1.0"))
    done = ocmm("camera", "firmware", "left", str(file), *VIRTUAL)
    assert done.returncode == 0, done.stderr
    assert "Firmware 2.1.0, 5000 bytes" in done.stdout
    assert "serial number 20600001 runs the firmware 2.1.0" in done.stdout


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda found: found[:-1] + bytes([found[-1] ^ 1]), "the maker of the camera did not sign"),
        (lambda found: found[:5], "it has 5 bytes"),
        (lambda _: firmware("2.1.0", product=7), "Give the firmware of this camera."),
    ],
)
def test_other_files_are_refused_and_the_old_firmware_runs(
    ocmm_here: Ocmm, tmp_path: Path, change: Callable[[bytes], bytes], why: str
) -> None:
    file = tmp_path / "camera.fw"
    file.write_bytes(change(firmware("2.1.0")))
    done = ocmm_here("camera", "firmware", "left", str(file), *VIRTUAL)
    assert done.returncode == 2
    assert why in " ".join(done.stderr.split())
    assert "runs the firmware" not in done.stdout


def test_a_camera_forgets_its_errors_and_says_how_many(ocmm_here: Ocmm) -> None:
    done = ocmm_here("camera", "clear", "left", *VIRTUAL)
    assert done.returncode == 0, done.stderr
    assert "Camera 'left' forgot 0 error(s); 0 left." in done.stdout


def test_a_camera_is_found_by_its_light(ocmm_here: Ocmm) -> None:
    done = ocmm_here("camera", "identify", "left", *VIRTUAL)
    assert done.returncode == 0, done.stderr
    assert "Camera 'left' blinks for " in done.stdout


def test_an_alias_of_another_camera_is_refused(ocmm_here: Ocmm) -> None:
    done = ocmm_here("camera", "alias", "left", "12", *VIRTUAL)
    assert done.returncode == 2
    assert "Give each camera its own alias. Then repeat the command." in " ".join(
        done.stderr.split()
    )
