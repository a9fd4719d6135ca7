"""The lock files pin everything by hash, name no place, and agree with each other."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from installer.locks import (
    BOARDS,
    DEVELOPMENT,
    DOCS,
    OPCUA,
    PACKAGE,
    ROOT,
    RUNTIME,
    SCREEN,
    SENSORS,
    SHOP,
    STEP,
    normalised,
    read_lock,
)
from ocmm_core.errors import InputError
from tests.host import HANG_S

_LOCKS = {
    path.name: path
    for path in (RUNTIME, STEP, SHOP, SENSORS, BOARDS, SCREEN, OPCUA, DEVELOPMENT, PACKAGE, DOCS)
}
_PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def _names(requirements: list[str]) -> set[str]:
    """Return the names of requirements as pyproject.toml writes them."""
    return {normalised(re.split(r"[^A-Za-z0-9._-]", text)[0]) for text in requirements}


def test_every_lock_file_is_known() -> None:
    assert {path.name for path in ROOT.glob("*.lock")} == set(_LOCKS)


@pytest.mark.parametrize("lock", _LOCKS)
def test_every_line_is_a_pin_or_its_hash(lock: str) -> None:
    lines = _LOCKS[lock].read_text(encoding="utf-8").splitlines()
    pins = read_lock(_LOCKS[lock])
    assert len(pins) == sum(bool(re.match(r"[^\s#]", line)) for line in lines)
    assert min(len(pin.hashes) for pin in pins.values()) >= 1


@pytest.mark.parametrize("lock", _LOCKS)
def test_no_place_is_named(lock: str) -> None:
    text = _LOCKS[lock].read_text(encoding="utf-8")
    assert not re.search(r"://| @ |file:|--index|--extra-index|--find-links|--trusted", text)
    # A package host is a name with a dot and letters behind it.
    words = {word for line in text.splitlines() for word in line.split() if "hash=" not in word}
    named = {word for word in words if re.match(r"\(?[\w-]+(\.[\w-]+)*\.[a-z]{2}", word)}
    assert not {word for word in named if not re.match(r"\(pyproject\.toml|requirements", word)}


@pytest.mark.parametrize("lock", _LOCKS)
def test_who_asked_for_a_package_stands_in_the_same_file(lock: str) -> None:
    pins = read_lock(_LOCKS[lock])
    # An extra of a package is requested by its name and the extra.
    asking = {one.split("[")[0] for pin in pins.values() for one in pin.needed_by}
    assert asking - {""} <= set(pins)
    assert all(pin.needed_by for pin in pins.values())


def test_whatever_the_project_asks_for_is_locked() -> None:
    project, groups = _PROJECT["project"], _PROJECT["dependency-groups"]
    extras = project["optional-dependencies"]
    station = [*extras["gui"], *extras["bus"], *extras["token"]]
    assert extras["station"] == ["ocmm[gui,bus,token]"]
    runtime = _names([*project["dependencies"], *station, *groups["build"]])
    assert runtime <= set(read_lock(RUNTIME))
    assert _names(groups["dev"]) <= set(read_lock(DEVELOPMENT))
    assert _names(groups["package"]) <= set(read_lock(PACKAGE))
    assert _names(extras["step"]) <= set(read_lock(STEP))
    assert _names(extras["shop"]) <= set(read_lock(SHOP))
    assert _names(extras["sensors"]) <= set(read_lock(SENSORS))
    assert _names(extras["boards"]) <= set(read_lock(BOARDS))
    assert _names(extras["screen"]) <= set(read_lock(SCREEN))
    assert _names(extras["opcua"]) <= set(read_lock(OPCUA))
    # A new extra or group needs a lock file, `lock_files` in `run`, and a line here.
    assert set(extras) == {
        "gui", "bus", "token", "station", "step", "shop", "sensors", "boards", "genicam", "screen",
        "opcua",
    }  # fmt: skip
    # Aravis comes from the system.
    assert not extras["genicam"]
    assert _names(groups["docs"]) <= set(read_lock(DOCS))
    assert set(groups) == {"build", "dev", "docs", "package"}


def test_the_core_requires_only_what_it_imports() -> None:
    of_extras = ("ocmm_gui", "ocmm_serve", "ocmm_boards")
    sources = [
        path.read_text("utf-8")
        for folder in ROOT.glob("ocmm_*")
        if folder.name not in of_extras
        for path in folder.rglob("*.py")
    ]
    for name in _names(_PROJECT["project"]["dependencies"]):
        imported = re.compile(rf"^\s*(?:from|import) {re.escape(name)}\b", re.M)
        assert any(map(imported.search, sources)), f"{name} belongs to an extra"


@pytest.mark.parametrize(
    "lock",
    [
        STEP.name,
        SHOP.name,
        SENSORS.name,
        BOARDS.name,
        SCREEN.name,
        OPCUA.name,
        DEVELOPMENT.name,
        PACKAGE.name,
        DOCS.name,
    ],
)
def test_the_other_sets_hold_the_runtime_set_in_the_same_versions_and_files(lock: str) -> None:
    other = read_lock(_LOCKS[lock])
    for name, pin in read_lock(RUNTIME).items():
        assert (other[name].version, other[name].hashes) == (pin.version, pin.hashes)


@pytest.mark.parametrize(
    "lock", [STEP, SHOP, SENSORS, BOARDS, SCREEN, OPCUA], ids=lambda path: path.name
)
def test_an_extra_and_the_development_set_agree(lock: Path) -> None:
    extra, development = read_lock(lock), read_lock(DEVELOPMENT)
    for name in extra.keys() & development.keys():
        assert extra[name].version == development[name].version


def test_the_extra_is_installed_with_hashes_wherever_it_is_named() -> None:
    text = (ROOT / "run").read_text("utf-8")
    for name, lock in (("install_step", STEP), ("install_shop", SHOP)):
        (install,) = re.findall(rf"^{name}\(\) \{{$.*?^\}}$", text, re.M | re.S)
        assert f"    install_locked {lock.name}\n" in install
    (locked,) = re.findall(r"^install_locked\(\) \($.*?^\)$", text, re.M | re.S)
    # By uv, and without uv by pip.
    assert len(re.findall(r'--require-hashes -r "\$1"', locked)) == 2
    for place in ("README.md", "docs/integrator/shop.md"):
        assert "./run setup --shop" in (ROOT / place).read_text(encoding="utf-8"), place
    for place in ("README.md", "docs/inspector/plans.md"):
        text = (ROOT / place).read_text(encoding="utf-8")
        assert "./run setup --step" in text, place
        assert "ocmm[step]" not in text, place


@pytest.mark.parametrize(
    "text",
    [
        "numpy>=2 \\\n    --hash=sha256:" + "0" * 64,
        "numpy==2 \\\n    --hash=md5:" + "0" * 32,
        "--index-url somewhere",
        "numpy==2 \\\n",
    ],
)
def test_a_lock_file_that_pins_less_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "broken.lock").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"\./run lock"):
        read_lock(tmp_path / "broken.lock")


def test_run_lock_asks_nothing_of_what_is_installed(tmp_path: Path) -> None:
    """pyproject.toml may contain a dependency that no environment has yet."""
    for name in ("run", "pyproject.toml", *_LOCKS):
        shutil.copy(ROOT / name, tmp_path)
    project = tmp_path / "pyproject.toml"
    text = project.read_text(encoding="utf-8")
    project.write_text(
        text.replace("dependencies = [", 'dependencies = [\n  "not-yet-installed",', 1),
        encoding="utf-8",
    )
    # An environment in the right place, whose records list all requirements.
    bin_ = tmp_path / ".venv" / "bin"
    bin_.mkdir(parents=True)
    (tmp_path / ".venv" / "ocmm-folder").write_text(f"{tmp_path}\n", encoding="utf-8")
    for name in ("python", "uv"):
        program = bin_ / name
        program.write_text(f'#!/bin/sh\necho "{name} $*" >>asked\n', encoding="utf-8")
        program.chmod(0o755)
    subprocess.run(
        ["sh", "./run", "lock", "--upgrade"],
        cwd=tmp_path, check=True, timeout=HANG_S, env={**os.environ, "PWD": str(tmp_path)},
    )  # fmt: skip
    asked = (tmp_path / "asked").read_text(encoding="utf-8").splitlines()
    assert asked[0] == "python -c import pip"
    made = [line for line in asked if line.startswith("uv pip compile")]
    assert [line.split(" -o ")[1] for line in made] == [f"{name} --upgrade" for name in _LOCKS]
    assert all("--generate-hashes" in line and "--no-emit-index-url" in line for line in made)
    assert len(made) == len(asked) - 1
