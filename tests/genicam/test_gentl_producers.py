"""Cameras by GenTL producers: one of others, and one that serves software cameras and lies."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest

from ocmm_sim.genicam import Feature, GigeConfig, Memory
from tests.commands import Ocmm
from tests.genicam.genicam_rig import (
    CONFIG,
    PERIOD_NS,
    SECOND,
    SIZE,
    image_of,
    place_at,
    small_rig,
)  # fmt: skip
from tests.host import HANG_S, not_run

ROOT = Path(__file__).resolve().parents[2]
_SOURCE = Path(__file__).with_name("software_producer.c")
_IMAGES, _MEMORY = 400, 0x4_0000
_WIDER, _HALF_FILLED, _OVERFILLED, _BUSY, _NO_TIME = range(1, 6)
_CAMERAS = "genicam:gentl,101,102"


@pytest.fixture(scope="module", autouse=True)
def _package() -> None:
    if find_spec("harvesters") is None:
        not_run("the package harvesters is not installed")


@pytest.fixture(scope="module")
def producer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a producer of software cameras."""
    if shutil.which("cc") is None:
        not_run("there is no compiler of C")
    folder = tmp_path_factory.mktemp("producer")
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-fvisibility=hidden", "-o", folder / "software.cti",
         _SOURCE],
        check=True, timeout=HANG_S,
    )  # fmt: skip
    return folder


@pytest.fixture
def cameras(producer: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of two cameras that the producer serves."""
    folder = tmp_path / "cameras"
    folder.mkdir()
    for config in (CONFIG, SECOND):
        _serve(folder, config)
    monkeypatch.setenv("GENICAM_GENTL64_PATH", str(producer))
    monkeypatch.setenv("OCMM_TEST_CAMERAS", str(folder))
    return folder


def _serve(folder: Path, config: GigeConfig) -> None:
    memory = Memory(config)
    memory.set_integer(Feature.PTP_ENABLE, 1)
    memory.write(Feature.RATE, struct.pack(">d", 1e9 / PERIOD_NS))
    memory.settle()
    (folder / f"{config.serial}.memory").write_bytes(memory.read(0, _MEMORY))
    images = b"".join(bytes(image_of(k)) for k in range(_IMAGES))
    (folder / f"{config.serial}.images").write_bytes(images)


def test_a_producer_of_others_is_listed(ocmm: Ocmm, monkeypatch: pytest.MonkeyPatch) -> None:
    """Viky of the GenICam group: three cameras without time."""
    found = find_spec("genicam")
    assert found is not None
    assert found.origin is not None
    monkeypatch.setenv("GENICAM_GENTL64_PATH", str(Path(found.origin).parent))
    done = ocmm("camera", "genicam", "--gentl")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Machine Vision Games Ltd. Viky") == 3
    assert done.stdout.count("400 x 400") == 3
    assert "0: Its exposure times cannot be proven: use genicam:untimed." in done.stdout


_VIKY = """
from ocmm_core.errors import OcmmError
from ocmm_genicam import Expected, Viewfinder, camera_library

library, told = camera_library(gentl=True), []
camera = library.open("1")
def tell(deed):
    try:
        deed()
    except OcmmError as error:
        told.append(error.code)
tell(lambda: library.open("1"))
tell(lambda: library.open("7"))
tell(lambda: camera.set_integer("Width", 7))
tell(lambda: camera.integer("Nothing"))
print(camera.has("Nothing"), camera.entries("PixelFormat"))
camera.close()
finder = Viewfinder(library, ["1", "2"], [Expected(one, 400, 400, 50_000_000) for one in "ab"])
dark = [int((one == 0).sum()) for one in finder.pictures()]
finder.close()
print(told, dark)
"""


def test_pictures_and_faults_of_a_producer_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """In use, absent, a value out of range, no feature; a black ball of 20 x 20 px on white."""
    found = find_spec("genicam")
    assert found is not None
    assert found.origin is not None
    monkeypatch.setenv("GENICAM_GENTL64_PATH", str(Path(found.origin).parent))
    assert _run(_VIKY) == (
        "['genicam.controlled', 'genicam.absent', 'genicam.camera', 'genicam.camera'] [400, 400]"
    )


_READ = """
import json, sys, time
from pathlib import Path
import numpy as np
from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.errors import OcmmError
from ocmm_genicam import Expected, GenicamSource, camera_library

folder, size, period_ns, most, *lies = sys.argv[1:]
size, period_ns = int(size), int(period_ns)
described = SourceDescription("test", (101, 102), period_ns, period_ns, True, True)
expected = [Expected(one, size, size, period_ns) for one in ("101", "102")]
told = []
for lie in lies:
    with (Path(folder) / "102.memory").open("r+b") as memory:
        memory.seek(0xF000)
        memory.write(int(lie).to_bytes(4, "big"))
    source, seen = None, []
    try:
        source = GenicamSource(described, camera_library(gentl=True), ("101", "102"), expected, 1.0)
        source.open()
        until = time.monotonic() + 20.0
        while len(seen) < int(most) and time.monotonic() < until:
            frames = source.read().frames
            for time_ns, uv in () if frames is None else zip(frames.time_ns, frames.uv):
                exposure = (int(time_ns) + source.origin_ns) // period_ns
                seen += [(exposure, *one) for one in uv[np.isfinite(uv[..., 0])].tolist()]
        accounts = [one.exposures - one.delivered - one.lost for one in source.accounts.values()]
        told.append(["", accounts, seen])
    except OcmmError as error:
        told.append([error.code, str(error), seen])
    finally:
        if source is not None:
            source.close()
print(json.dumps(told))
"""


def test_spots_arrive_through_a_producer_and_its_lies_are_sentences(cameras: Path) -> None:
    """A spot that moves by 0.94 px from exposure to exposure is at the place of its time.

    A size beyond the buffer is read to the end of the buffer; the other lies give no frame.
    """
    lies = {
        0: "", _OVERFILLED: "", _WIDER: "genicam.image", _BUSY: "genicam.controlled",
        # A silent camera is left to its heartbeat, and ends the process.
        _NO_TIME: "genicam.no_time", _HALF_FILLED: "genicam.silent",
    }  # fmt: skip
    told = json.loads(_run(_READ, cameras, SIZE, PERIOD_NS, 100, *lies))
    assert [code for code, _, _ in told] == list(lies.values())
    for code, unaccounted, seen in told:
        if code:
            assert seen == []
            continue
        assert unaccounted == [0, 0]
        off = [np.linalg.norm(np.array(uv) - place_at(exposure)) for exposure, *uv in seen]
        assert len(off) >= 100
        assert max(off) < 0.1


def test_exposure_and_views_by_commands(ocmm: Ocmm, cameras: Path, tmp_path: Path) -> None:
    rig, views = small_rig(tmp_path), tmp_path / "views"
    given = ("--source", _CAMERAS, "--rig", rig)
    done = ocmm("camera", "expose", *given, "--exposure", "250")
    assert done.returncode == 0, done.stderr + done.stdout
    assert done.stdout.count("250") >= 2
    done = ocmm("calibrate", "pictures", views, *given, "--views", "1", "--every", "0.3")
    assert done.returncode == 0, done.stderr
    places = [
        np.unravel_index(np.argmax(np.asarray(cv2.imread(str(path), -1))), (SIZE, SIZE))
        for path in sorted(views.glob("001-*.png"))
    ]
    assert len(places) == 2
    assert np.ptp(places, axis=0).max() <= 1


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(b"", "No GenTL producer (.cti) was found"), (b"no library", "broken.cti cannot be loaded")],
)
def test_a_missing_or_broken_producer_is_a_sentence(
    ocmm: Ocmm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, sentence: str
) -> None:
    monkeypatch.setenv("GENICAM_GENTL64_PATH", str(tmp_path))
    if content:
        (tmp_path / "broken.cti").write_bytes(content)
    done = ocmm("camera", "genicam", "--gentl")
    assert done.returncode == 2
    assert sentence in " ".join(done.stderr.split())


def _run(program: str, *arguments: object) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)], cwd=ROOT, capture_output=True,
        text=True, timeout=HANG_S, env=os.environ.copy(), check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().splitlines()[-1]
