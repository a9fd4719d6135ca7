"""One version: sources, changelog, citation and installation commands agree."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from installer.locks import ROOT
from ocmm_core import __version__
from ocmm_core.build import FORMAT, BuildIdentity
from ocmm_core.errors import InputError
from ocmm_core.manual import changes_since
from tests.host import HANG_S, not_run


@pytest.mark.parametrize(
    ("place", "pattern"),
    [
        ("CITATION.cff", r"^version: (\S+)$"),
        ("README.md", r"ocmm[_-](\d[\d.]*\d)[_-]"),
        ("installer/station/README.md", r"ocmm_(\d[\d.]*\d)_"),
        ("installer/conda/recipe.yaml", r'^  version: "(.+)"$'),
    ],
)
def test_states_the_version_of_the_sources(place: str, pattern: str) -> None:
    found = re.findall(pattern, (ROOT / place).read_text("utf-8"), re.MULTILINE)
    assert set(found) == {__version__}


def test_changelog_starts_with_the_version_of_the_sources() -> None:
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = re.findall(r"^## \[(\d[\d.]*)\] - (\d{4}-\d\d-\d\d)$", text, re.MULTILINE)
    assert released[0][0] == __version__
    assert [day for _version, day in released] == sorted(
        (day for _v, day in released), reverse=True
    )


def test_names_the_commit_unless_it_is_the_release() -> None:
    commit, date = "1a2b3c4d5e6f" + 28 * "0", "2026-11-28T22:00:00+00:00"
    released, later = f"v{__version__}", f"v{__version__}-3-g1a2b3c4"
    for identity, version in (
        (BuildIdentity(), __version__),
        (BuildIdentity(commit, date, released), __version__),
        (BuildIdentity(commit, date, later), f"{__version__}+g1a2b3c4d5e.20261128"),
        (BuildIdentity(commit, date, "v0.1.0"), f"{__version__}+g1a2b3c4d5e.20261128"),
        (
            BuildIdentity(commit, date, released, True),
            f"{__version__}+g1a2b3c4d5e.20261128.changed",
        ),
    ):
        assert identity.version == version
    # `git archive` fills the words that this module asks git for.
    assert (ROOT / "ocmm_core/_build.txt").read_text("utf-8") == f"$Format:{FORMAT}$\n"
    assert "ocmm_core/_build.txt export-subst" in (ROOT / ".gitattributes").read_text("utf-8")


@pytest.mark.slow
def test_the_wheel_of_the_source_distribution_is_that_of_the_checkout(tmp_path: Path) -> None:
    if not (ROOT / ".git").exists():
        not_run("this is no checkout")
    clone, unpacked = tmp_path / "clone", tmp_path / "unpacked"
    subprocess.run(["git", "clone", "-q", ROOT, clone], check=True, timeout=HANG_S)
    stated = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}

    def build(folder: Path, kind: str, out: Path) -> Path:
        out.mkdir()
        code = f"import setuptools.build_meta as b; b.build_{kind}({str(out)!r})"
        subprocess.run(
            [sys.executable, "-c", code], cwd=folder, env=stated, check=True, timeout=HANG_S,
            capture_output=True,
        )  # fmt: skip
        return next(out.iterdir())

    archive = build(clone, "sdist", tmp_path / "sdist")
    with tarfile.open(archive) as tar:
        tar.extractall(unpacked, filter="data")
    (inside,) = unpacked.iterdir()
    for left in (clone / "build", clone / "ocmm.egg-info"):
        shutil.rmtree(left, ignore_errors=True)
    first, second = build(clone, "wheel", tmp_path / "a"), build(inside, "wheel", tmp_path / "b")
    assert first.name == second.name
    assert first.read_bytes() == second.read_bytes()
    commit = subprocess.run(
        ["git", "-C", clone, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
    ).stdout.strip()
    with zipfile.ZipFile(first) as wheel:
        assert wheel.read("ocmm_core/_build.txt").decode().split()[0] == commit
        assert f"+g{commit[:10]}." in first.name
        chapters = [name for name in wheel.namelist() if "/resources/manual/" in name]
        assert len(chapters) > 140
        assert "ocmm_core/resources/CHANGELOG.md" in wheel.namelist()


def test_the_last_versions_can_be_built_from_the_history() -> None:
    text = (ROOT / "installer" / "RELEASING.md").read_text("utf-8")
    named = re.findall(r"(\d+\.\d+\.\d+) was ([0-9a-f]{9})", text)
    released = re.findall(
        r"^## \[(\d[\d.]*)\] - ", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )
    tagged = re.findall(r"^ +for old in (.+); do$", text, re.MULTILINE)
    assert tagged == [" ".join(f"v{one}" for one in reversed(released[:2]))]
    for version, commit in named:
        found = subprocess.run(
            ["git", "-C", ROOT, "show", f"{commit}:ocmm_core/__init__.py"],
            capture_output=True, text=True, timeout=HANG_S, check=False,
        )  # fmt: skip
        if found.returncode:
            not_run("this checkout lacks the history")
        assert f'__version__ = "{version}"' in found.stdout
    assert [version for version, _ in named] == list(reversed(released[:2]))


def test_conda_packages_need_what_wheels_need() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    text = (ROOT / "installer/conda/recipe.yaml").read_text("utf-8")
    core, window = (
        dict(re.findall(r"^ {8}- ([\w-]+) ([<>=].+)$", part, re.MULTILINE))
        for part in text.split("    requirements:\n      host:")[1].split("name: ocmm-gui")
    )
    # Packages that build a wheel are listed with those that run it.
    wheel = {"python": project["requires-python"], "setuptools": ">=77"}
    for found, lines, named in (
        (core, project["dependencies"], wheel),
        (window, project["optional-dependencies"]["gui"], {}),
    ):
        # conda-forge names packages in small letters, and has all of Qt in one.
        wanted = dict(
            re.findall(
                r"^([\w-]+)(.+)$", "\n".join(lines).lower().replace("-essentials", ""), re.MULTILINE
            )
        )
        assert found == wanted | named


def test_lists_the_changes_since_a_version() -> None:
    newest, every = changes_since(), changes_since("0.1.0")
    assert newest[-1].startswith(f"## [{__version__}]")
    assert every == newest
    with pytest.raises(InputError, match=r"does not contain version .0\.0\.1"):
        changes_since("0.0.1")
