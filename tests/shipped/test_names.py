"""Names in the installation's files, in the pages about rights and in our messages exist."""

from __future__ import annotations

import importlib
import re
import subprocess
import tomllib
from pathlib import Path

from tests.commands import Ocmm
from tests.host import HANG_S

ROOT = Path(__file__).resolve().parents[2]
_LINUX = ROOT / "installer" / "linux"
_STATION = ROOT / "installer" / "station" / "root" / "usr" / "lib" / "systemd" / "system"
_WHERE = ("*.md", "run", "docs/*.md", "docs/de/*.md", "installer/**/*", "ocmm_*/**/*.py")
_PAGES = [
    path
    for pattern in _WHERE
    for path in sorted(ROOT.glob(pattern))
    if path.is_file() and path.suffix != ".pyc"
]
_TEXTS = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in _PAGES}


def _named(pattern: str, group: int | str = 0) -> set[tuple[str, str]]:
    """Return the matches of a pattern, with their pages."""
    return {
        (page, found[group])
        for page, text in _TEXTS.items()
        for found in re.finditer(pattern, text)
    }


def test_every_unit_named_is_a_file() -> None:
    units = _named(r"(?<![\w@.-])ocmm[\w.-]*@?\.(?:service|socket|target|timer)\b")
    assert {name for _, name in units} >= {"ocmm-acq@.service", "ocmm-acq.socket"}
    for page, name in units:
        assert (_LINUX / name).is_file() or (_STATION / name).is_file(), f"{page}: {name}"


def test_every_journal_named_is_of_a_unit() -> None:
    journals = _named(r"journalctl -u '?([\w@.*-]+)", 1)
    assert journals
    for page, name in journals:
        # An instance of a template; systemd adds the kind.
        assert (_LINUX / f"{name.replace('@*', '@')}.service").is_file(), f"{page}: {name}"


def test_every_file_of_the_installation_named_is_there() -> None:
    files = _named(r"(?<![\w/])installer(?:/[\w.@-]*[\w@-])+")
    assert len(files) > 5
    for page, name in files:
        assert (ROOT / name).exists(), f"{page}: {name}"


def test_every_lock_file_named_is_there() -> None:
    for page, name in _named(r"requirements[\w-]*\.lock"):
        assert (ROOT / name).is_file(), f"{page}: {name}"


def test_every_file_of_the_sources_named_by_a_unit_or_page_of_rights_is_there() -> None:
    for unit in _LINUX.glob("ocmm-acq*"):
        for path in re.findall(r"/opt/ocmm/(?!\.venv)(\S+)", unit.read_text(encoding="utf-8")):
            assert (ROOT / path).exists(), f"{unit.name}: {path}"


def test_every_module_started_by_name_is_there() -> None:
    modules = _named(r"-m (ocmm_\w+(?:\.\w+)*|installer(?:\.\w+)+)\b", 1)
    assert any(page == "installer/linux/ocmm-acq@.service" for page, _ in modules)
    for page, name in modules:
        # Without its folder's own import: a module of the window needs no Qt here.
        folder = ROOT.joinpath(*name.split("."))
        there = folder.with_suffix(".py").is_file() or (folder / "__main__.py").is_file()
        assert there, f"{page}: {name}"


def test_every_option_of_the_script_of_rights_is_one() -> None:
    script = (_LINUX / "grant-rights.sh").read_text(encoding="utf-8")
    known = set(re.findall(r"^ +(--\w+)\)", script, re.M))
    assert known == {"--venv", "--group", "--remove", "--check"}
    for page, rest in _named(r"grant-rights\.sh((?: +--\w+)+)", 1):
        for option in rest.split():
            assert option in known, f"{page}: {option}"


def test_the_script_of_rights_explains_itself() -> None:
    done = subprocess.run(
        ["sh", str(_LINUX / "grant-rights.sh"), "--help"],
        capture_output=True, text=True, check=True, timeout=HANG_S,
    )  # fmt: skip
    assert "installer/linux/ocmm-acq@.service" in done.stdout


def test_the_user_and_the_group_of_the_units_are_made() -> None:
    made: dict[str, str] = {}
    for line in (_LINUX / "ocmm.sysusers").read_text(encoding="utf-8").splitlines():
        if line[:1] in ("g", "u"):
            kind, name = line.split()[:2]
            made[name] = kind
    asked: dict[str, str] = {}
    for unit in _LINUX.glob("ocmm-acq*"):
        for key, name in re.findall(
            r"^(User|Group|SocketGroup)=(\S+)", unit.read_text(encoding="utf-8"), re.M
        ):
            asked[name] = "u" if key == "User" else "g"
    assert asked == made
    # That of serial lines is the system's.
    made["dialout"] = "g"
    for page, name in _named(r"usermod -aG (\w+)", 1):
        assert made.get(name) == "g", f"{page}: {name}"


def test_the_address_and_the_settings_of_the_service_are_the_same_everywhere() -> None:
    socket = (_LINUX / "ocmm-acq.socket").read_text(encoding="utf-8")
    address = re.search(r"^ListenStream=(\S+)", socket, re.M)
    assert address is not None
    assert {name for _, name in _named(r"/run/ocmm/[\w.]*\w")} == {address[1]}
    assert {name for _, name in _named(r"/etc/ocmm/[\w.]*\w")} == {"/etc/ocmm/bus.env"}


def test_our_programs_are_made_by_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(project["scripts"]) == {"ocmm", "ocmm-acq"}
    for place in project["scripts"].values():
        module, function = place.split(":")
        assert callable(getattr(importlib.import_module(module), function))


def test_every_task_of_run_named_is_one() -> None:
    tasks = set(re.findall(r"^    (\w+)\)(?: |$)", _TEXTS["run"], re.M))
    for page, name in _named(r"\./run (\w+)", 1):
        assert name in tasks, f"{page}: ./run {name}"


def test_what_the_page_of_security_names_is_there() -> None:
    """It promises protections by the files that give them."""
    text = _TEXTS["SECURITY.md"]
    named = re.findall(r"`((?:benchmarks|docs|installer|ocmm_core|ocmm_gui|tests)/[^`]+)`", text)
    linked = re.findall(r"\]\(([^)#]+)(#[^)]+)?\)", text)
    assert len(named) > 8
    assert len(linked) > 8
    for path in named:
        assert (ROOT / path).exists(), path
    for path, place in linked:
        page = (ROOT / path).read_text(encoding="utf-8")
        heads = re.findall(r"^#+ (.+)$", page, re.M)
        slugs = {re.sub(r"[^\w -]", "", head).lower().replace(" ", "-") for head in heads}
        assert not place or place[1:] in slugs, f"{path}{place}"


def test_the_commands_that_the_page_of_security_names_are_there(ocmm_here: Ocmm) -> None:
    commands = re.findall(
        r"`ocmm ([a-z]+(?: [a-z]+)*)", re.sub(r"<!--.*?-->", "", _TEXTS["SECURITY.md"])
    )
    assert commands
    for command in commands:
        done = ocmm_here(*command.split(), "--help")
        assert done.returncode == 0, f"ocmm {command}: {done.stderr}"
