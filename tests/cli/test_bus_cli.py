"""``ocmm bus`` as a stranger uses it: a virtual wire in real processes, exit codes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.objects import encoder_for
from tests.commands import Ocmm
from tests.core.acquisition.test_capture import bringup, steady, write_pcap
from tests.host import HANG_S, private_network

VIRTUAL = ("--source", "ethercat:virtual")


@pytest.fixture
def virtual() -> None:
    """Need a virtual wire."""
    private_network()


@pytest.mark.parametrize("suffix", [".png", ".pgm"])
def test_pictures_are_read_by_another_program_as_they_were(suffix: str, tmp_path: Path) -> None:
    picture = np.random.default_rng(1).integers(0, 1 << 14, (37, 53), np.uint16)
    path = tmp_path / f"picture{suffix}"
    path.write_bytes(encoder_for(path)(picture))
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert found is not None
    np.testing.assert_array_equal(found, picture)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("scan", "--source", "simulated"), "is not a camera bus"),
        (("scan", "--source", "ethercat:service"), "whose bus is private"),
        (("scan", "--source", "ethercat:"), "not a frame source"),
        (("object", "read", "left", "10180", *VIRTUAL), "not the address of an object"),
        (("object", "read", "middle", "1018", *VIRTUAL), "has no camera 'middle'"),
        (
            ("object", "write", "left", "8000:02", "5g", *VIRTUAL),
            "not a sequence of hexadecimal bytes",
        ),
        (("snapshot", "left", "picture.jpg", *VIRTUAL), "not a picture file name"),
        (("snapshot", "left", "a.png", "--region", "1,2,3", *VIRTUAL), "which is not a region"),
        (("scan", "--source", "ethercat:nothere0"), "No network interface 'nothere0'"),
        (("decode", "gone.pcap"), "cannot be opened"),
    ],
)
def test_what_cannot_be_done_is_one_sentence_and_a_remedy(
    arguments: tuple[str, ...], why: str
) -> None:
    # `ocmm_cli.main` prints the error; that is tested with the other commands.
    done = CliRunner().invoke(app, ["bus", *arguments])
    assert isinstance(done.exception, OcmmError)
    assert why in done.exception.what
    assert done.exception.remedy


def test_a_recording_is_accounted_for_and_kept_for_replay(ocmm_here: Ocmm, tmp_path: Path) -> None:
    write_pcap(tmp_path / "bus.pcap", bringup() + steady(20))
    done = ocmm_here("bus", "decode", "bus.pcap", "--record", "frames.ocmr")
    assert done.returncode == 2
    assert "77, 78 are not those of the rig" in done.stderr
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    rig = tmp_path / "rig.toml"
    rig.write_text(text.replace("20600001", "77").replace("20600002", "78"), "utf-8")
    done = ocmm_here("bus", "decode", "bus.pcap", "--record", "frames.ocmr", "--rig", rig)
    assert (done.returncode, done.stderr) == (0, "")
    assert "20 sent, 20 answered" in done.stdout
    assert "160 from all cameras, 0 not from all" in done.stdout
    assert (tmp_path / "frames.ocmr").stat().st_size > 160 * 276


def _hear_ctrl_c() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.timing
@pytest.mark.slow
@pytest.mark.usefixtures("virtual")
class TestVirtualWire:
    """The bus itself: cameras must answer within a millisecond."""

    def test_scan_names_every_device_and_compares(self, ocmm: Ocmm, tmp_path: Path) -> None:
        done = ocmm("bus", "scan", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "20600001" in done.stdout
        assert "0xfa4e0001" in done.stdout
        assert "These are the cameras of the rig." in done.stdout

    def test_scan_compares_described_cameras_with_their_description(
        self, ocmm: Ocmm, tmp_path: Path
    ) -> None:
        rig = tmp_path / "described.toml"
        text = resource("rigs", "recommended.toml").read_text()
        size = "\nheight_px = 2048\n"
        rig.write_text(text.replace(size, f'{size}device = "thesis-camera"\n'))
        done = ocmm("bus", "scan", "--rig", str(rig), *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "These are the cameras of the rig." in done.stdout

    def test_objects_are_written_and_read(self, ocmm_here: Ocmm) -> None:
        done = ocmm_here("bus", "object", "read", "left", "1018:04", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "20600001" in done.stdout
        done = ocmm_here("bus", "object", "write", "left", "10f1:02", "0500", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "05 00" in done.stdout
        done = ocmm_here("bus", "object", "read", "left", "7777", *VIRTUAL)
        assert done.returncode == 2
        assert "Camera 'left'" in done.stderr
        assert "object does not exist" in done.stderr

    def test_a_snapshot_is_a_picture_of_the_region(self, ocmm_here: Ocmm, tmp_path: Path) -> None:
        done = ocmm_here("bus", "snapshot", "right", "a.png", "--region", "100,80,64,48", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        found = cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)
        assert found is not None
        assert found.shape == (48, 64)
        assert found.dtype == np.uint16
        # The dark level of the sensor, and 14 bits.
        assert 50 < found.mean() < 1 << 14

    def test_black_image_and_intrinsics_are_kept(self, ocmm_here: Ocmm) -> None:
        done = ocmm_here("bus", "black", "measure", "left", "--frames", "8", "--store", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "in use and stored" in done.stdout
        done = ocmm_here("bus", "intrinsics", "write", "left", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        # Another start is another camera, which was never given any.
        done = ocmm_here("bus", "intrinsics", "read", "left", *VIRTUAL)
        assert done.returncode == 1
        assert "stores no intrinsics" in done.stdout
        done = ocmm_here("bus", "history", "left", *VIRTUAL)
        assert (done.returncode, done.stderr) == (0, "")
        assert "has no errors in its history" in done.stdout

    def test_ctrl_c_gives_a_picture_up_and_leaves_nothing(self, tmp_path: Path) -> None:
        command = [sys.executable, "-m", "ocmm_cli", "bus", "snapshot", "left", "a.png"]
        with subprocess.Popen(
            [*command, *VIRTUAL],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # A program that was started in the background ignores Ctrl-C, and so do its children.
            preexec_fn=_hear_ctrl_c,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        ) as process:
            assert process.stdout is not None
            assert any("Ctrl-C" in line for line in iter(process.stdout.readline, ""))
            # The whole sensor takes much longer than that.
            time.sleep(0.5)
            os.killpg(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=HANG_S)
        assert process.returncode == 130, out + err
        assert "Stopped" in out
        assert "Traceback" not in err
        assert list(tmp_path.iterdir()) == []
