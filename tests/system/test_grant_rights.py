"""`grant-rights.sh` copies an executable of the system and nothing else, behind any link."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.host import HANG_S, needs_root, needs_tools, not_run, on_linux_only

pytestmark = [on_linux_only]

_GRANT = Path(__file__).resolve().parents[2] / "installer" / "linux" / "grant-rights.sh"
_SECRET = b"only root may read this\n"
_USER = 65533


@pytest.fixture
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return a folder with a secret of root, and an environment of a user."""
    needs_root("give rights to a file")
    needs_tools("setcap", "findmnt")
    if not _system_python().is_file():
        not_run("there is no Python of the system")
    folder = tmp_path_factory.mktemp("grant")
    (folder / "secret").write_bytes(_SECRET)
    (folder / "secret").chmod(0o600)
    (folder / "venv" / "bin").mkdir(parents=True)
    os.chown(folder / "venv" / "bin", _USER, _USER)
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def _system_python() -> Path:
    return Path("/usr/bin/python3").resolve()


def grant(folder: Path) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if name != "SUDO_USER"}
    return subprocess.run(
        ["sh", str(_GRANT), "--venv", str(folder / "venv"), "--group", "nogroup"],
        capture_output=True, text=True, check=False, timeout=HANG_S, env=plain,
    )  # fmt: skip


def python_of(folder: Path) -> Path:
    return folder / "venv" / "bin" / "python"


def _secret(folder: Path) -> None:
    python_of(folder).symlink_to(folder / "secret")


def _secret_named_python(folder: Path) -> None:
    secret = folder / "python3.11"
    (folder / "secret").rename(secret)
    python_of(folder).symlink_to(secret)


def _shadow(folder: Path) -> None:
    python_of(folder).symlink_to("/etc/shadow")


def _other_program(folder: Path) -> None:
    python_of(folder).symlink_to("/usr/bin/env")


def _own_copy(folder: Path) -> None:
    shutil.copy(_system_python(), python_of(folder))


def _copy_of_root_in_an_open_folder(folder: Path) -> None:
    (folder / "open").mkdir()
    (folder / "open").chmod(0o777)
    copy = Path(shutil.copy(_system_python(), folder / "open" / "python3.11"))
    python_of(folder).symlink_to(copy)


def _hard_link(folder: Path) -> None:
    python = folder / "venv" / "bin" / "python3.11"
    try:
        os.link(_system_python(), python)
    except OSError:
        shutil.copy(_system_python(), python)
    python_of(folder).symlink_to(python)


def _script(folder: Path) -> None:
    script = folder / "venv" / "bin" / "python3.11"
    script.write_text("#!/bin/sh\nexec id\n", encoding="utf-8")
    script.chmod(0o755)
    python_of(folder).symlink_to(script)


def _pipe(folder: Path) -> None:
    os.mkfifo(folder / "venv" / "bin" / "python3.11")
    python_of(folder).symlink_to("python3.11")


def _loop(folder: Path) -> None:
    python_of(folder).symlink_to("python")


def _folder(folder: Path) -> None:
    (folder / "venv" / "bin" / "python3.11").mkdir()
    python_of(folder).symlink_to("python3.11")


def _device(folder: Path) -> None:
    python_of(folder).symlink_to("/dev/zero")


_ATTACKS = (
    _secret, _secret_named_python, _shadow, _other_program, _own_copy,
    _copy_of_root_in_an_open_folder, _hard_link, _script, _pipe, _loop, _folder, _device,
)  # fmt: skip


@pytest.mark.parametrize("attack", _ATTACKS, ids=lambda attack: attack.__name__.strip("_"))
def test_refuses_everything_but_a_program_of_the_system(
    place: Path, attack: Callable[[Path], None]
) -> None:
    attack(place)
    done = grant(place)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("ocmm: ")
    assert {one.name for one in (place / "venv" / "bin").iterdir()} <= {"python", "python3.11"}


def test_takes_the_python_that_a_users_environment_was_made_from(place: Path) -> None:
    # As `venv` makes it: a link to a link.
    (place / "venv" / "bin" / "python3").symlink_to("/usr/bin/python3")
    python_of(place).symlink_to("python3")
    done = grant(place)
    if "does not keep rights" in done.stderr or "nosuid" in done.stderr:
        not_run(f"rights cannot be given to files here: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    target = place / "venv" / "bin" / "ocmm-acq-python"
    original = _system_python().stat()
    state = target.stat()
    assert (state.st_uid, state.st_mode & 0o7777) == (0, 0o750)
    # `ocmm_core` compares them to notice an outdated copy.
    assert (state.st_size, int(state.st_mtime)) == (original.st_size, int(original.st_mtime))
    assert target.read_bytes() == _system_python().read_bytes()


def test_a_link_that_changes_all_the_time_never_leads_to_a_secret(place: Path) -> None:
    """The owner of the environment exchanges the link while root works: 12 times."""
    link, spare = python_of(place), place / "venv" / "bin" / "spare"
    link.symlink_to("/usr/bin/python3")
    (place / "python3.11").write_bytes(b"\x7fELF" + _SECRET)
    (place / "python3.11").chmod(0o600)
    ended = threading.Event()

    def exchange() -> None:
        while not ended.is_set():
            for there in (place / "python3.11", _system_python()):
                spare.symlink_to(there)
                spare.replace(link)
            time.sleep(0)

    attacker = threading.Thread(target=exchange)
    attacker.start()
    try:
        for _ in range(12):
            grant(place)
            target = place / "venv" / "bin" / "ocmm-acq-python"
            if target.exists():
                assert target.read_bytes() == _system_python().read_bytes()
                target.unlink()
    finally:
        ended.set()
        attacker.join()
