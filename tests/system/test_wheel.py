"""A wheel contains everything in the repository, and works without the repository."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from benchmarks.house_tree import ROOTS
from tests.host import HANG_S, needs_tools, not_run

_ROOT = Path(__file__).resolve().parents[2]
_TOP = ("CHANGELOG.md", "LICENSE", "THIRD_PARTY_LICENCES.md")
_PACKAGES = (*ROOTS, "resources")
_WHERE = (
    "import ocmm_core.documents as d, ocmm_core.manual as m; "
    "print(d.__file__, d.resource('rigs', 'recommended.toml'), m.manual_folder(), "
    "len(m.load_manual().chapters))"
)

pytestmark = pytest.mark.slow


def _done(command: list[str], folder: Path, **environment: str) -> str:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def _pip(*arguments: str, folder: Path) -> None:
    offline = ("--disable-pip-version-check", "--no-index", "--no-deps", "--no-cache-dir")
    _done([sys.executable, "-m", "pip", *arguments, *offline], folder)


@pytest.fixture(scope="module")
def tracked() -> list[str]:
    """Return files known to git that exist."""
    needs_tools("git")
    if not (_ROOT / ".git").exists():
        not_run("this is no checkout of git")
    # Whoever runs the tests need not be who owns the folder.
    git = ["git", "-c", f"safe.directory={_ROOT}", "ls-files", "-z"]
    listed = _done(git, _ROOT).split("\0")
    return [name for name in listed if name and (_ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tracked: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a wheel of the files known to git, in a clean folder."""
    source = tmp_path_factory.mktemp("source")
    for name in tracked:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(_ROOT / name, source / name)
    folder = tmp_path_factory.mktemp("wheel")
    _pip("wheel", "--no-build-isolation", "--wheel-dir", str(folder), ".", folder=source)
    (made,) = folder.glob("ocmm-*.whl")
    return made


def test_wheel_holds_every_file_of_the_packages_and_of_resources(
    wheel: Path, tracked: list[str]
) -> None:
    shipped = [name for name in tracked if name.startswith(tuple(f"{p}/" for p in _PACKAGES))]
    assert "resources/ethercat/ocmm_camera.xml" in shipped
    with zipfile.ZipFile(wheel) as archive:
        held = {
            # Only there does the folder have another name.
            name.removeprefix("ocmm_core/") if name.startswith("ocmm_core/resources/") else name
            for name in archive.namelist()
            if ".dist-info/" not in name
        }
        manual = {name for name in held if name.startswith("resources/manual/")}
        assert held - manual == {*shipped, *map("resources/{}".format, _TOP)}
        # Every document of the repository, and the pictures that they show, not the programs there.
        shown = {f"docs/{name.removeprefix('resources/manual/')}" for name in manual}
        assert shown <= set(tracked)
        assert {name for name in shown if name.endswith(".md")} == {
            name for name in tracked if re.fullmatch(r"docs/(\w+/)*[^/]+\.md", name)
        }
        assert "docs/images/window_dark_measuring.png" in shown
        assert not [name for name in shown if name.endswith((".py", ".json"))]
        for name in shipped:
            if name.startswith("resources/"):
                assert archive.read(f"ocmm_core/{name}") == (_ROOT / name).read_bytes()


def test_command_of_a_wheel_reads_what_the_wheel_ships(wheel: Path, tmp_path: Path) -> None:
    """Without options it studies the shipped probe with its shipped design and the shipped rig."""
    packages = tmp_path / "packages"
    _pip("install", "--no-compile", "--target", str(packages), str(wheel), folder=tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    path = str(packages)
    *found, count = _done([sys.executable, "-c", _WHERE], elsewhere, PYTHONPATH=path).split()
    assert found == [
        str(packages / "ocmm_core" / "documents.py"),
        str(packages / "ocmm_core" / "resources" / "rigs" / "recommended.toml"),
        str(packages / "ocmm_core" / "resources" / "manual"),
    ]
    assert int(count) > 70
    command = [sys.executable, "-m", "ocmm_cli", "probe", "design", "--poses", "100"]
    said = _done(command, elsewhere, PYTHONPATH=path)
    assert "Weight of the probe" in said
    assert (elsewhere / "ocmm-out" / "probe_bending.svg").is_file()
