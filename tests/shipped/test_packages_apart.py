"""Packages next to the core: left out, added by others, or wrong."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.golden.write import points_in
from tests.host import HANG_S
from tests.short_plan import wire_plan_in
from tests.slow_rig import slow_rig_in
from tests.waiting import wait_until

ROOT = Path(__file__).resolve().parents[2]
_HIDE = """
import sys
class Never:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {hidden!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Never())
"""
_LAB = """
from pathlib import Path
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing
from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.composition import Feed, Origin, SourceSpec

def make(request, plan, rig, value):
    source = ReplaySource(Path(value), request.speed)
    ring = FrameRing.create(len(rig.cameras), n_slots=source.description.n_slots)
    return Feed(
        AcquisitionWorker(source, ring), ring, source.description,
        live=False, recorded=source.recording.head.source,
    )

SPEC = SourceSpec(
    prefix="lab:", forms=(("lab:FILE", "cameras of the laboratory"),), takes_value=True,
    origin=Origin.RECORDING, live=False, on_bus=False, recorded_as="", make=make,
)
THIEF = SourceSpec(
    prefix="replay:", forms=(("replay:FILE", "stolen"),), takes_value=True,
    origin=Origin.RECORDING, live=False, on_bus=False, recorded_as="", make=None,
)
LIAR = SourceSpec(
    prefix="liar", forms=(("liar", "calls recordings of real cameras virtual"),), takes_value=False,
    origin=Origin.VIRTUAL, live=False, on_bus=False, recorded_as="EtherCAT", make=make,
)
NO_SPEC = 7
"""
_ENTRIES = """
[ocmm.sources]
lab = lab_cameras:SPEC
thief = lab_cameras:THIEF
liar = lab_cameras:LIAR
number = lab_cameras:NO_SPEC
broken = lab_broken:SPEC
[ocmm.commands]
audit = lab_cameras:NO_SPEC
"""


def _run(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=HANG_S,
        env={**os.environ, **environment}, check=False,
    )  # fmt: skip


def _ocmm(hidden: tuple[str, ...], *arguments: str | Path) -> str:
    words = ["ocmm", *map(str, arguments)]
    return (
        f"{_HIDE.format(hidden=hidden)}\nfrom ocmm_cli import main\nsys.argv = {words!r}\nmain()\n"
    )


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """Return a recording of a plan of one ball, its rig and the plan."""
    tmp_path = tmp_path_factory.mktemp("recorded")
    rig, path = slow_rig_in(tmp_path), tmp_path / "raw.ocmmrec"
    plan = wire_plan_in(tmp_path)
    done = _run(_ocmm((), "record", "--out", path, "--plan", plan, "--rig", rig), tmp_path)
    assert done.returncode == 0, done.stderr
    return path, rig, plan


def test_fits_need_the_core_alone(tmp_path: Path) -> None:
    hidden = (
        "ocmm_sim", "ocmm_cad", "ocmm_shop", "ocmm_cli", "ocmm_gui", "ocmm_serve", "ocmm_bench",
        "ocmm_genicam", "ocmm_trackers", "ocmm_boards", "ocmm_machine", "ocmm_planner",
        "PySide6",
        "pyqtgraph", "pysoem", "dask", "psycopg", "OCP", "typer", "rich",
    )  # fmt: skip
    done = _run(
        _HIDE.format(hidden=hidden) + "import numpy as np\n"
        "from ocmm_core.features import Shape, fit\n"
        "rng = np.random.default_rng(1)\n"
        "points = rng.normal(size=(50, 3))\n"
        "points = 10 * points / np.linalg.norm(points, axis=1)[:, None] + [1, 2, 3]\n"
        "print(fit(Shape.SPHERE, points).diameter)\n",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


def test_the_import_of_the_fits_loads_no_compiler(tmp_path: Path) -> None:
    # numba and scipy's solvers are two thirds of the time of the import.
    done = _run(
        "import sys\nfrom ocmm_core.features import fit_shape\n"
        "print(sorted({'numba', 'scipy.optimize', 'scipy.linalg', 'scipy.spatial'}"
        " & set(sys.modules)))\n",
        tmp_path,
    )
    assert done.stdout == "[]\n", done.stderr


def test_without_the_virtual_rig_commands_and_window_measure_a_recording(
    recording: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    path, rig, plan = recording
    given = ("--source", f"replay:{path}", "--plan", plan, "--rig", rig, "--out")
    hidden = ("ocmm_sim", "ocmm_bench")
    done = _run(_ocmm(hidden, "measure", *given, tmp_path / "out"), tmp_path)
    assert "PART" in done.stdout, done.stderr
    assert done.returncode in (0, 1)
    measured = points_in(tmp_path / "out")
    assert measured > 0
    words = ["ocmm_gui", *map(str, given), str(tmp_path / "seen"), "--silent", "--speed", "0"]
    program = (
        f"{_HIDE.format(hidden=hidden)}\nimport runpy\nsys.argv = {words!r}\n"
        "runpy.run_module('ocmm_gui', run_name='__main__')\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=tmp_path, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
    ) as window:  # fmt: skip
        try:
            wait_until(
                lambda: points_in(tmp_path / "seen") == measured or window.poll() is not None
            )
            window.terminate()
            _, errors = window.communicate(timeout=HANG_S)
        finally:
            window.kill()
    assert window.returncode == 0, errors
    assert points_in(tmp_path / "seen") == measured


def test_a_virtual_source_without_its_package_is_a_sentence(tmp_path: Path) -> None:
    done = _run(_ocmm(("ocmm_sim",), "demo", "--headless"), tmp_path)
    assert done.returncode == 2
    assert "'simulated', which is not a frame source" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    done = _run(_ocmm(("ocmm_sim",), "study", "probe-calibration"), tmp_path)
    assert done.returncode == 2
    assert "needs the package 'ocmm_sim'" in done.stderr


def test_cameras_without_their_master_are_refused_before_the_job(tmp_path: Path) -> None:
    plan = ROOT / "resources" / "plans" / "quick.toml"
    done = _run(
        "import sys\nsys.modules['pysoem'] = None\n"
        + _ocmm((), "measure", "--source", "ethercat:lo", "--plan", plan, "--out", "jobs"),
        tmp_path,
    )
    assert done.returncode == 2, done.stderr
    assert "pysoem, the EtherCAT master, is not installed here. Install it: " in " ".join(
        done.stderr.split()
    )
    assert "points" not in done.stderr
    assert not list(tmp_path.glob("jobs/*.ocmm"))


def test_a_package_of_one_file_adds_a_source(
    recording: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    """And others that claim a name of ours, or are none, change nothing."""
    path, rig, plan = recording
    added = tmp_path / "added"
    info = added / "lab-1.0.dist-info"
    info.mkdir(parents=True)
    (added / "lab_cameras.py").write_text(_LAB)
    (added / "lab_broken.py").write_text("raise RuntimeError('no driver')\n")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(_ENTRIES)
    done = _run(
        _ocmm((), "measure", "--source", f"lab:{path}", "--plan", plan, "--rig", rig, "--out", "o"),
        tmp_path, PYTHONPATH=str(added),
    )  # fmt: skip
    assert "PART" in done.stdout, done.stderr
    told = _run(
        "from ocmm_core.composition import source_of, sources, virtual_names\n"
        "print([one.prefix for one in sources()], source_of('replay:x').spec.forms)\n"
        "print('EtherCAT on eth0'.startswith(virtual_names()))\n",
        tmp_path, PYTHONPATH=str(added),
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    assert told.stdout.count("lab:") == 1
    assert "stolen" not in told.stdout
    assert told.stdout.splitlines()[-1] == "False"
    assert "no driver" in told.stderr
    audit = _run(_ocmm((), "audit", "--help"), tmp_path, PYTHONPATH=str(added))
    assert audit.returncode == 0
    assert "verify" in audit.stdout
