"""The set-up for Windows, as far as it can be checked elsewhere; it was never run on Windows."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from installer.locks import RUNTIME, read_lock
from tests.host import HANG_S, needs_tools

ROOT = Path(__file__).resolve().parents[2]
WINDOWS = ROOT / "installer" / "windows"
SCRIPT = WINDOWS / "office.nsi"


def compiled(tmp_path: Path, *definitions: str) -> subprocess.CompletedProcess[str]:
    """Compile the set-up with a wheel of nothing in it."""
    house = tmp_path / "house"
    house.mkdir()
    (house / "ocmm-0-py3-none-any.whl").write_bytes(b"nothing")
    for name in ("install.ps1", "win_amd64.lock"):
        (house / name).write_bytes((WINDOWS / name).read_bytes())
    return subprocess.run(
        ["makensis", "-V2", "-WX", f"-DWHEELHOUSE={house}", *definitions, str(SCRIPT)],
        capture_output=True, text=True, timeout=HANG_S, check=False, cwd=tmp_path,
    )  # fmt: skip


def test_the_set_up_compiles(tmp_path: Path) -> None:
    needs_tools("makensis")
    made = tmp_path / "ocmm-office-NEVER-RUN-ON-WINDOWS.exe"
    done = compiled(tmp_path, "-DVERSION=0", f"-DOUT={made}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert made.read_bytes()[:2] == b"MZ"


def test_it_does_not_compile_without_a_version(tmp_path: Path) -> None:
    needs_tools("makensis")
    done = compiled(tmp_path, f"-DOUT={tmp_path / 'any.exe'}")
    assert done.returncode != 0
    assert "VERSION" in done.stdout + done.stderr


@pytest.mark.parametrize("name", sorted(path.name for path in WINDOWS.iterdir()))
def test_every_file_says_that_it_was_never_run(name: str) -> None:
    if name in ("lock.sh", "win_amd64.lock"):
        # These make and hold a list; they do not run there.
        return
    assert "NEVER RUN ON WINDOWS" in (WINDOWS / name).read_text(encoding="utf-8")


def test_its_packages_are_those_of_the_lock_but_for_what_only_one_system_has() -> None:
    here, there = read_lock(RUNTIME), read_lock(WINDOWS / "win_amd64.lock")
    assert {name: pin.version for name, pin in there.items() if name in here} == {
        name: here[name].version for name in there if name in here
    }
    assert there.keys() <= here.keys()
    assert here.keys() - there.keys() == {"asn1crypto", "pysoem", "python-pkcs11"}
    for name, pin in there.items():
        assert set(pin.hashes) <= set(here[name].hashes)
