"""Software GigE Vision cameras read by a client of others (Aravis), what fails, and a whole job."""

from __future__ import annotations

import ctypes
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from ocmm_core.documents import resource
from tests.commands import Ocmm
from tests.genicam.genicam_faults import AT_START, IN_USE, OF_PACKETS
from tests.host import HANG_S, long_form, not_run, private_network
from tests.short_plan import wire_plan_in

ROOT = Path(__file__).resolve().parents[2]
_REPEATS = 5 if long_form() else 1
_SENTENCE_S = 3.0
_DEAF = ("unplugged", "both unplugged", "commands not heard")


def _of(faults: Iterable[str], *short: str) -> list[str]:
    """Return all faults in the long form, some of them in the short one."""
    return list(faults) if long_form() else list(short)


@pytest.fixture(scope="module", autouse=True)
def _library() -> None:
    try:
        ctypes.CDLL("libaravis-0.8.so.0")
    except OSError:
        not_run("libaravis-0.8-0 is not installed")


Played = Callable[..., dict[str, Any]]


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """Return a function that plays a scenario in a private network and returns its result."""
    program = [sys.executable, "-m", "tests.genicam.genicam_scenarios", str(int(HANG_S))]
    messages = tmp_path_factory.mktemp("genicam") / "stderr"
    with (
        messages.open("w") as stream,
        subprocess.Popen(
            [*private_network(), *program], cwd=ROOT, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=stream, text=True,
        ) as process,
    ):  # fmt: skip

        def play(name: str, repeats: int = _REPEATS) -> dict[str, Any]:
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(f"{repeats} {name}\n")
            process.stdin.flush()
            line = process.stdout.readline()
            assert line.strip(), messages.read_text()
            result: dict[str, Any] = json.loads(line)
            assert result["wrong"] == 0
            return result

        yield play


def test_forty_kinds_of_faults_are_played() -> None:
    assert len({*IN_USE, *AT_START, *OF_PACKETS}) >= 40


@pytest.mark.slow
@pytest.mark.parametrize("fault", _of(OF_PACKETS, "lost", "swapped", "damaged", "cut packets"))
def test_faulty_packets_give_no_wrong_frame_and_frames_come_again(
    played: Played, fault: str
) -> None:
    result = played(fault, 3 * _REPEATS)
    assert result["clean"] > 0
    for _during, after, seconds in result["counts"]:
        assert after >= 20
        assert seconds < _SENTENCE_S
    # A busy computer loses some that arrive in order, too; each is counted once.
    assert [unaccounted for unaccounted, _, _ in result["accounts"]] == [0, 0]
    assert result["right"] >= 40


@pytest.mark.slow
def test_pictures_of_a_view_are_of_one_moment(played: Played) -> None:
    """A spot that moves by 0.94 px from exposure to exposure is at one place in both pictures."""
    result = played("pictures", 2)
    assert result["files"] == [
        f"{view:03d}-{one}.png" for view in (1, 2, 3, 4) for one in (101, 102)
    ]
    assert max(result["apart"]) < 0.1
    assert result["away"] < 0.5


@pytest.mark.slow
def test_a_killed_camera_process_is_a_sentence_and_can_be_started_again(played: Played) -> None:
    """Aravis may crash: the end is reported at once; the cameras are free after 3 s of silence."""
    result = played("killed")
    for message, seconds in result["ends"]:
        assert "ended unexpectedly" in message
        assert seconds < _SENTENCE_S
    assert len(result["returns"]) == _REPEATS


@pytest.mark.slow
def test_another_dissector_finds_no_malformed_packet(played: Played) -> None:
    if shutil.which("tshark") is None:
        not_run("tshark is not installed")
    result = played("dissected")
    assert result["gvcp"] > 20
    assert result["gvsp"] > 100
    assert result["malformed"] == 0


@pytest.mark.slow
def test_a_camera_of_others_is_read(played: Played) -> None:
    """Images with packets that were lost are complete, too: they are requested again."""
    if find_spec("viva_genicam") is None:
        not_run("the package viva-genicam is not installed")
    result = played("foreign")
    assert result["found"] == ["viva-genicam FakeGigE"]
    assert result["told"].startswith("genicam.size: Camera FAKE-001 has 4096 x 4096 px, but ")
    numbers = [number for number, *_ in result["images"]]
    assert numbers == list(range(numbers[0], numbers[0] + 12))
    assert all(one[1:] == [0, 256, 256] for one in result["images"])


@pytest.mark.slow
def test_sixty_four_spots_of_each_camera_arrive(played: Played) -> None:
    result = played("many spots")
    assert result["found"] == [64, 64]
    assert result["off"] < 0.05


@pytest.mark.slow
def test_hot_pixels_of_a_black_image_do_not_move_a_spot(played: Played) -> None:
    """One of three is 2.2 px from the LED, three quarters as bright: scatter of a spot 0.01 px."""
    result = played("hot")
    assert result["before"] > 0.1
    assert result["after"] < 0.05
    assert result["region"] < 0.05
    # No black image is stored while an LED is seen.
    assert "Camera 101 sees light while its black image is taken" in result["refused"]
    assert result["left"] == 0
    assert result["taken"].count("black image stored, 3 hot pixel(s).") == 2
    assert result["damaged"] == "genicam.black_file"


@pytest.mark.slow
def test_spots_of_a_part_of_the_sensor_are_where_they_are_on_the_sensor(played: Played) -> None:
    """The part is widened to the steps of the camera: 4 and 2 px, sizes of 8 and 2 px."""
    result = played("region")
    assert result["frames"] >= 50
    assert result["right"] >= 50
    assert result["part"] == [60, 58, 136, 140]


@pytest.mark.slow
def test_cameras_that_share_a_card_are_refused_or_send_less(played: Played) -> None:
    """98,304 bytes of two cameras 100 times a second, and 10 Mbit/s with MTU 1500."""
    if not Path("/dev/net/tun").exists():
        not_run("no virtual network card can be made here")
    result = played("shared card")
    assert result["loads"] == ["19.7 / 1 MB/s cameras"] * 2
    refused, part = result["told"]
    assert refused.startswith("genicam.adapter: The cameras 101, 102 send 19.7 MB/s, but network ")
    assert part == ""


@pytest.mark.slow
def test_cameras_without_a_common_clock_are_paired_by_counting(played: Played) -> None:
    result = played("untimed")
    assert result["frames"] >= 50
    # Exposures that arrive together; lost ones do not shift the pairs.
    assert abs(result["usual"]) <= 1
    assert result["lost"][0] > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    _of(
        IN_USE, "unplugged", "clock step", "small clock step", "old time", "wrong format",
        "another part", "same number", "large packets lost", "control taken", "PTP lost",
        "other master",
    ),
)  # fmt: skip
def test_a_camera_that_fails_is_a_sentence_in_three_seconds(played: Played, name: str) -> None:
    result = played(name)
    assert [told[0] for told in result["told"]] == [IN_USE[name]] * _REPEATS
    # A camera that hears no commands is asked five times for half a second.
    limit_s = _SENTENCE_S + (2.5 if name in _DEAF else 0.0)
    assert all(told[2] < limit_s for told in result["told"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    _of(
        AT_START, "controlled", "two masters", "no PTP", "late exposures", "absent", "other size",
        "colour", "gamma stays", "slow link", "other model", "no ticks", "description cut",
    ),
)  # fmt: skip
def test_cameras_that_cannot_measure_are_refused(played: Played, name: str) -> None:
    result = played(name)
    assert [told[0] for told in result["told"]] == [AT_START[name]] * _REPEATS
    # The controller is not disturbed by the one that is refused.
    assert name != "controlled" or result["frames"] > 0


@pytest.mark.slow
def test_exposure_is_set_by_the_brightest_led(played: Played) -> None:
    """One time for both cameras; what one cannot take leaves both as they were."""
    result = played("viewfinder")
    dark, bright, settled, brighter, again, _, faint = (one[0] for one in result["found"])
    assert dark[0] == "too dark"
    assert dark[1] == pytest.approx(0.1, abs=0.05)
    assert bright[0] == "too bright"
    for one in (settled, again, faint):
        assert one[0] == "good"
        assert one[1] == pytest.approx(0.7, abs=0.08)
    assert brighter[1] > 0.9
    # The lowest gain: more of it only for LEDs that the longest exposure leaves too dark.
    assert [settled[3], brighter[3], again[3]] == [0.0, 6.0, 0.0]
    assert again[2] == pytest.approx(settled[2], rel=0.15)
    assert 5_000.0 < faint[2] <= 10_000.0
    # Black level, and 10 % of the light.
    assert 20.0 * math.log10(0.7 / (0.02 * faint[2] / 1000.0)) == pytest.approx(faint[3], abs=1.5)
    # Its place, and the width of the light.
    assert settled[5:7] == pytest.approx([150.0, 90.0], abs=0.02)
    assert settled[4] == pytest.approx(1.5, abs=0.15)
    assert settled[7:] == [256, 256]
    assert all(one[0][2] == one[1][2] for one in result["found"])
    out_of_range, too_long, gain, ended = result["told"]
    assert out_of_range.startswith("genicam.out_of_range: Camera 101 does not take an exposure")
    assert too_long.startswith("genicam.rate: Camera 101 takes 20 frames a second, but the rig ")
    assert gain.startswith("genicam.out_of_range: Camera 101 does not take a gain of 99")
    assert ended.startswith("genicam.viewfinder: ")
    assert result["kept"] == [faint[2], faint[2]]
    assert result["stored"] == [1, 1]
    assert result["shape"] == [256, 256]
    assert 40_000 < result["picture"][0] <= 65_535
    assert result["left"] == 0


@pytest.mark.slow
def test_cameras_are_set_up_and_views_taken_in_the_window(tmp_path: Path) -> None:
    """By its keys: exposure, darker, stored; a view of a board; too few views are refused."""
    done = subprocess.run(
        [*private_network(), sys.executable, "-m", "tests.genicam.camera_sheet_program", tmp_path],
        cwd=ROOT, capture_output=True, text=True, timeout=HANG_S,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert all("too dark" in one for one in found["first"])
    assert all("good" in one for one in found["exposed"])
    assert "Camera 101 sees light while its black image is taken" in found["lit"]
    assert found["black"] == "The black images are stored."
    assert found["asked"] == "Field 'Board' is empty: enter a path."
    # The nine views in the folder count.
    assert found["view"].startswith("View 10: 40, 40 corners. Camera 'left': ")
    assert "focal length of camera 'left' is known only to" in found["refused"]
    assert not found["accepts"]
    assert found["kept"] == 1
    assert found["left"] == 0


def test_cameras_that_process_their_images_are_set_to_send_what_the_sensor_saw(
    played: Played,
) -> None:
    result = played("set up")
    assert result["kept"] == [[0, 0], [0, 0]]
    printed = " ".join(result["printed"].split())
    assert "101" in printed
    assert "102: Its exposure times cannot be proven: use genicam:untimed." in printed
    assert "101: Its" not in printed


def test_a_missing_library_is_a_sentence() -> None:
    code = (
        "from ocmm_genicam import _aravis\n"
        "_aravis._LIBRARY = 'libaravis-of-nobody.so'\n"
        "from ocmm_genicam import AravisCameras\n"
        "AravisCameras()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=HANG_S,
        check=False,
    )  # fmt: skip
    assert "AcquisitionError" in done.stderr
    assert "apt-get install libaravis-0.8-0" in done.stderr


def test_cameras_of_another_rig_are_refused_before_the_job(ocmm: Ocmm, tmp_path: Path) -> None:
    plan = resource("plans", "quick.toml")
    done = ocmm(
        "measure", "--source", "genicam:20600002,20600001", "--plan", plan, "--out", tmp_path,
        "--uncalibrated",
    )  # fmt: skip
    assert done.returncode == 2
    assert "in the order of the rig" in " ".join(done.stderr.split())
    assert not list(tmp_path.glob("*.ocmm"))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, *((4, 5) if long_form() else ())])
def test_a_part_is_measured_by_cameras_that_anyone_can_buy(
    ocmm_here: Ocmm, tmp_path: Path, seed: int
) -> None:
    """Sensors of 1.6 megapixels at 100 Hz, as in many such cameras."""
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    for old, new in (
        ("frame_rate_hz = 8000", "frame_rate_hz = 100"),
        ("width_px = 2048", "width_px = 1440"),
        ("height_px = 2048", "height_px = 1080"),
        ("u0_px = 1023.5", "u0_px = 719.5"),
        ("v0_px = 1023.5", "v0_px = 539.5"),
    ):
        assert old in text
        text = text.replace(old, new)
    rig = tmp_path / "rig.toml"
    rig.write_text(text, "utf-8")
    private_network()
    done = ocmm_here(
        "measure", "--source", "genicam:virtual", "--plan", wire_plan_in(tmp_path),
        "--rig", rig, "--out", tmp_path, "--seed", str(seed),
    )  # fmt: skip
    assert "PART CONFORMS" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0
