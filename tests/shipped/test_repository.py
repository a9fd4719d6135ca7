"""`installer/repository.sh`: apt takes what the key of a release has signed, and nothing else."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from installer.locks import ROOT
from tests.host import HANG_S, needs_tools

ADDRESS = "releases@example.com"


def _run(*words: str | Path, **options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(word) for word in words], check=False, capture_output=True, text=True,
        timeout=HANG_S, env={**os.environ, "LC_ALL": "C", **options},
    )  # fmt: skip


def _package(folder: Path, version: str, content: str = "") -> Path:
    (folder / "DEBIAN").mkdir(parents=True)
    (folder / "content").write_text(content + version, "utf-8")
    control = (
        f"Package: ocmm\nVersion: {version}\nArchitecture: amd64\nMaintainer: O <o@example.com>\n"
    )
    (folder / "DEBIAN" / "control").write_text(f"{control}Description: test\n", "utf-8")
    file = folder.with_suffix(".deb")
    assert _run("dpkg-deb", "--root-owner-group", "--build", folder, file).returncode == 0
    return file


class Apt:
    """The apt of this computer with folders of its own, and one repository."""

    def __init__(self, folder: Path, repository: Path, key: Path) -> None:
        self.folder = folder
        for place in ("state/lists/partial", "cache/archives/partial"):
            (folder / place).mkdir(parents=True)
        sources = folder / "sources.list"
        sources.write_text(f"deb [signed-by={key}] file:{repository} stable main\n", "utf-8")
        self._options = [
            f"-oDir::State={folder}/state", f"-oDir::Cache={folder}/cache",
            "-oDir::State::status=/dev/null", f"-oDir::Etc::sourcelist={sources}",
            "-oDir::Etc::sourceparts=-", "-oAPT::Sandbox::User=root",
        ]  # fmt: skip

    def __call__(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["apt-get", *self._options, *words], check=False, capture_output=True, text=True,
            timeout=HANG_S, cwd=self.folder, env={**os.environ, "LC_ALL": "C"},
        )  # fmt: skip


@pytest.fixture
def keys() -> Iterator[str]:
    needs_tools("gpg", "apt-get", "dpkg-deb", "dpkg-scanpackages")
    # The name of the socket of GnuPG's agent may have 107 characters; `tmp_path` is too long.
    with TemporaryDirectory(prefix="gpg") as home:
        made = ("--batch", "--passphrase", "", "--quick-gen-key", ADDRESS, "ed25519", "sign")
        result = _run("gpg", *made, GNUPGHOME=home)
        assert result.returncode == 0, result.stderr
        yield home
        # GnuPG leaves its agent running.
        _run("gpgconf", "--kill", "gpg-agent", GNUPGHOME=home)


def _make(keys: str, out: Path, *packages: Path, key: str = ADDRESS) -> tuple[int, str]:
    script = ROOT / "installer" / "repository.sh"
    result = _run(script, "--key", key, "--out", out, *packages, GNUPGHOME=keys)
    return result.returncode, result.stderr


def test_apt_upgrades_goes_back_and_refuses_what_is_not_signed(tmp_path: Path, keys: str) -> None:
    old, new = _package(tmp_path / "old", "0.2.0-1"), _package(tmp_path / "new", "0.3.0-1")
    out = tmp_path / "repository"
    assert _make(keys, out, old) == (0, f"repository: 1 packages, signed by {ADDRESS}, in {out}\n")
    assert _make(keys, out, new)[0] == 0
    apt = Apt(tmp_path / "apt", out, out / "ocmm.gpg")
    updated = apt("update")
    assert updated.returncode == 0, updated.stderr
    assert not updated.stderr
    for wanted, file in (("ocmm", new), ("ocmm=0.2.0-1", old)):
        taken = apt("download", wanted)
        assert taken.returncode == 0, taken.stderr
        version = "0.3.0-1" if file is new else "0.2.0-1"
        assert (apt.folder / f"ocmm_{version}_amd64.deb").read_bytes() == file.read_bytes()
        (apt.folder / f"ocmm_{version}_amd64.deb").unlink()
    # Other bytes under the name of a signed package.
    forged = out / "pool" / "main" / "o" / "ocmm" / "ocmm_0.3.0-1_amd64.deb"
    forged.write_bytes(_package(tmp_path / "forged", "0.3.0-1", "forged ").read_bytes())
    assert apt("download", "ocmm").returncode != 0
    # Lists that were changed after they were signed.
    signed = out / "dists" / "stable" / "InRelease"
    signed.write_text(signed.read_text("utf-8").replace("Label: OCMM", "Label: OTHER"), "utf-8")
    refused = Apt(tmp_path / "again", out, out / "ocmm.gpg")("update")
    assert "BADSIG" in refused.stdout + refused.stderr


def test_refuses_another_package_of_the_same_version(tmp_path: Path, keys: str) -> None:
    out = tmp_path / "repository"
    first = _package(tmp_path / "first", "0.2.0-1")
    assert _make(keys, out, first)[0] == 0
    before = (out / "dists" / "stable" / "InRelease").read_bytes()
    code, said = _make(keys, out, _package(tmp_path / "second", "0.2.0-1", "other "))
    assert (code, "Raise the version" in said) == (2, True)
    assert (out / "dists" / "stable" / "InRelease").read_bytes() == before


def test_names_what_is_wrong(tmp_path: Path, keys: str) -> None:
    file = tmp_path / "notes.deb"
    file.write_text("no package", "utf-8")
    out = tmp_path / "repository"
    assert _make(keys, out, file) == (2, f"repository: '{file}' is no package of OCMM.\n")
    assert _make(keys, out) == (2, "repository: Name at least one package.\n")
    code, said = _make(keys, out, file, key="nobody@example.com")
    assert (code, said) == (2, "repository: GnuPG has no secret key 'nobody@example.com'.\n")
    assert not out.exists()
