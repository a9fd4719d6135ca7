"""The parts of the packages are consistent; installer/test.sh tries the packages themselves."""

from __future__ import annotations

import ast
import configparser
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from benchmarks.house_tree import ROOTS
from installer.bundle import kernels, pages
from installer.locks import ROOT
from ocmm_cli import app, kernel_groups
from ocmm_core import cpu_features
from tests.host import HANG_S, needs_tools, on_linux_only

_DEBIAN = ROOT / "installer" / "debian"
_BUILD = (ROOT / "installer" / "build.sh").read_text(encoding="utf-8")
_SCRIPTS = [_DEBIAN / name for name in ("preinst", "postinst", "prerm", "postrm")] + [
    ROOT / "installer" / name for name in ("build.sh", "test.sh")
]
_AVX2 = "fpu avx avx2 bmi1 bmi2 f16c fma movbe popcnt sse4_2 abm"


@pytest.mark.parametrize("script", _SCRIPTS, ids=lambda path: path.name)
def test_a_shell_can_read_every_script(script: Path) -> None:
    subprocess.run(["sh", "-n", str(script)], check=True, timeout=HANG_S)
    assert os.access(script, os.X_OK)
    assert re.search(r"^set -", script.read_text(encoding="utf-8"), re.M)


def test_a_commit_that_is_not_in_the_history_is_a_sentence(tmp_path: Path) -> None:
    needs_tools("git")
    for name, does in (("id", "echo 0"), ("mmdebstrap", "exit 1")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{does}\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    done = subprocess.run(
        [str(ROOT / "installer/test.sh"), "--from", "v0.0.0", "--work", str(tmp_path / "work")],
        capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
    )  # fmt: skip
    assert done.returncode == 2
    assert "does not contain 'v0.0.0'" in done.stderr


def test_every_file_that_the_build_names_is_there() -> None:
    named = set(re.findall(r"\binstaller/[\w./@-]*\w", _BUILD)) - {"installer/build.sh"}
    assert len(named) > 8
    for name in named:
        assert (ROOT / name).exists(), name


def test_the_service_starts_a_program_of_the_package() -> None:
    """The build replaces the program in the unit; its search text must be in the unit."""
    changed = re.search(r"sed 's#\^(ExecStart=\S+ )#(ExecStart=\S+ )#'", _BUILD)
    assert changed is not None
    unit = (ROOT / "installer/linux/ocmm-acq@.service").read_text(encoding="utf-8")
    assert unit.count(f"\n{changed[1]}-I -m ocmm_core.") == 1
    assert changed[2] == "ExecStart=/opt/ocmm/ocmm "


def test_the_desktop_entry_opens_jobs_and_the_window_takes_one() -> None:
    entry = configparser.RawConfigParser(strict=True)
    entry.optionxform = str  # type: ignore[assignment,method-assign] # as documented by typeshed
    entry.read(_DEBIAN / "ocmm.desktop", encoding="utf-8")
    desktop = entry["Desktop Entry"]
    assert desktop["Exec"] == "/opt/ocmm/ocmm -m ocmm_gui --start %f"
    assert (_DEBIAN / f"{desktop['Icon']}.svg").is_file()
    types = ElementTree.parse(_DEBIAN / "ocmm-mime.xml").getroot()  # noqa: S314 - our own file
    space = "{http://www.freedesktop.org/standards/shared-mime-info}"
    (kind,) = types.findall(f"{space}mime-type")
    assert desktop["MimeType"] == f"{kind.get('type')};"
    assert [one.get("pattern") for one in kind.findall(f"{space}glob")] == ["*.ocmm"]


def test_the_icon_is_a_picture() -> None:
    root = ElementTree.parse(_DEBIAN / "ocmm.svg").getroot()  # noqa: S314 - our own file
    assert root.tag == "{http://www.w3.org/2000/svg}svg"


def test_the_man_page_names_every_command() -> None:
    import typer

    page = pages.man_page(app)

    def names(path: str, command: object) -> set[str]:
        found = set()
        for name, one in command.commands.items():  # type: ignore[attr-defined] # click's
            if not one.hidden:
                deeper = hasattr(one, "commands")
                found |= names(f"{path} {name}", one) if deeper else {f"{path} {name}"}
        return found

    wanted = names("ocmm", typer.main.get_command(app))
    assert len(wanted) > 40
    assert set(re.findall(r'^\.SS "(.+)"$', page, re.M)) == wanted
    assert "compile" not in page.split(".SH COMMANDS")[1].split(".SS")[0]
    # Lines that begin with a dot are orders to the formatter.
    orders = {line.split()[0] for line in page.splitlines() if line.startswith(".")}
    assert orders == {".TH", ".SH", ".SS", ".PP", ".TP", ".B", ".BR"}
    assert "ocmm-acq" in pages.bus_page()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_words(shell: str) -> None:
    assert "_OCMM_COMPLETE" in pages.completion(shell)


@pytest.mark.parametrize(
    ("flags", "kind"),
    [
        ([_AVX2], cpu_features.AVX2),
        ([f"{_AVX2} avx512f"], cpu_features.AVX2),
        ([_AVX2.replace(" fma", "")], cpu_features.GENERIC),
        ([_AVX2, "fpu sse2"], cpu_features.GENERIC),
        ([], cpu_features.GENERIC),
    ],
)
def test_a_processor_gets_the_kernels_that_it_can_run(flags: list[str], kind: str) -> None:
    cpuinfo = "".join(f"processor\t: 0\nflags\t\t: {one}\n\n" for one in flags)
    assert kernels.processor_kind(cpuinfo) == kind


def test_the_kernels_for_any_processor_can_be_asked_for_and_no_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NUMBA_CPU_NAME", cpu_features.GENERIC)
    kind, told = kernels.choose()
    assert kind == cpu_features.GENERIC
    assert "slower" in told
    monkeypatch.setenv("NUMBA_CPU_NAME", "../x")
    kind, told = kernels.choose()
    assert kind in cpu_features.KINDS
    assert "'../x'" in told
    # A processor without the requested instructions would end the program silently.
    monkeypatch.setenv("NUMBA_CPU_NAME", cpu_features.AVX2)
    monkeypatch.setattr(kernels, "processor_kind", lambda _: cpu_features.GENERIC)
    assert kernels.choose()[0] == cpu_features.GENERIC


def test_no_two_groups_of_kernels_share_a_function() -> None:
    """Two processes that compile the same function forget each other's result."""
    reached = [_compiled_modules({module for module, _, _ in group}) for group in kernel_groups()]
    assert all(len(modules) > 1 for modules in reached)
    for number, modules in enumerate(reached):
        for others in reached[number + 1 :]:
            assert modules & others == set()


def _compiled_modules(wanted: set[str]) -> set[str]:
    """Return the modules, and their imports, with their compiled functions."""
    found: set[str] = set()
    while wanted:
        name = wanted.pop()
        path = ROOT.joinpath(*name.split(".")).with_suffix(".py")
        if name in found or not path.is_file():
            continue
        text = path.read_text(encoding="utf-8")
        # A function inlined into its callers is not compiled separately.
        if not re.search(r"^@(?:njit|compiled)\b(?!.*inline=\"always\")", text, re.M):
            continue
        found.add(name)
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module:
                wanted |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
    return found


def test_nothing_that_the_package_leaves_out_is_needed(tmp_path: Path) -> None:
    """Every module of OCMM is imported without them; later imports are named."""
    (tmp_path / "generic.json").write_text('{"helpers": [], "kernels": []}', encoding="utf-8")
    code = (
        "import sys\n"
        "class Never:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if any(name == one or name.startswith(one + '.') for one in {_left_out()!r}):\n"
        "            raise ModuleNotFoundError(name)\n"
        "sys.meta_path.insert(0, Never())\n"
        "from pathlib import Path\n"
        "from installer.bundle import linked\n"
        f"linked.install(Path({str(tmp_path)!r}), 'generic')\n"
        "import importlib as i, pkgutil\n"
        f"for root in {ROOTS!r}:\n"
        "    for one in pkgutil.walk_packages(i.import_module(root).__path__, root + '.'):\n"
        "        if not one.name.endswith('__main__'):\n"
        "            i.import_module(one.name)\n"
        "import scipy.linalg, scipy.ndimage, scipy.optimize, scipy.sparse.linalg\n"
        "import scipy.spatial.transform, scipy.special\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    later = {
        name
        for root in ROOTS
        for path in (ROOT / root).rglob("*.py")
        for name in re.findall(r"^\s+(?:from|import) ([\w.]+)", path.read_text("utf-8"), re.M)
    }
    assert "xlsxwriter" in later
    # The replacement of the compilers was present for the imports above.
    left_out = tuple(f"{name}." for name in _left_out() if name not in {"numba", "llvmlite"})
    assert {name for name in later if f"{name}.".startswith(left_out)} == set()


def _left_out() -> list[str]:
    spec = (ROOT / "installer/bundle/ocmm.spec").read_text(encoding="utf-8")
    never, compilers = re.findall(
        r"^(?:never|compilers) = (\[.*?\])(?:  # fmt: skip)?$", spec, re.M | re.S
    )
    names: list[str] = ast.literal_eval(never) + ast.literal_eval(compilers)
    assert {"scipy.signal", "numba", "llvmlite"} <= set(names)
    return names


def test_a_program_of_the_package_starts_parts_of_ocmm_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("print('mine')", encoding="utf-8")
    code = "from installer.bundle.start import run_ocmm; run_ocmm()"

    def said(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path, capture_output=True, text=True, timeout=HANG_S, check=False,
            env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}"},
        )  # fmt: skip

    window = said("-I", "-m", "ocmm_gui", "--help")
    assert "usage: ocmm window" in window.stdout, window.stderr
    assert said("--version").stdout.startswith("ocmm ")
    for words in (("-m", "mine"), ("-c", "print('mine')"), ("mine.py",)):
        refused = said(*words)
        assert "mine" not in refused.stdout
        assert refused.returncode == 2, refused.stderr


@on_linux_only
def test_the_program_with_rights_understands_one_word(tmp_path: Path) -> None:
    code = "from installer.bundle.start import run_ocmm_acq; run_ocmm_acq()"

    def said(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path, capture_output=True, text=True, timeout=HANG_S, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip

    times = said("--wake", "0.05", "-1")
    assert json.loads(times.stdout)["cycles"] == 50, times.stderr
    for words in (
        ("--wake", "0.05"),
        ("-m", "ocmm_gui"),
        ("-I", "-m", "ocmm_core.doctor._wake", "1", "-1"),
    ):
        refused = said(*words)
        assert refused.returncode == 2, refused.stderr
        assert refused.stdout == ""


def test_after_unpacking_user_group_and_rights_are_there(tmp_path: Path) -> None:
    """In a folder in place of a computer, by programs that log their arguments."""
    acq = tmp_path / "opt" / "ocmm" / "ocmm-acq"
    acq.parent.mkdir(parents=True)
    acq.write_text("", encoding="utf-8")
    log = tmp_path / "log"
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    for name in ("getent", "groupadd", "useradd", "chown", "setcap", "systemctl"):
        does = "exit 1" if name == "getent" else "exit 0"
        (bin_ / name).write_text(f'#!/bin/sh\necho "{name} $*" >>{log}\n{does}\n', encoding="utf-8")
        (bin_ / name).chmod(0o755)

    def configured() -> list[str]:
        log.write_text("", encoding="utf-8")
        subprocess.run(
            [str(_DEBIAN / "postinst"), "configure"], check=True, timeout=HANG_S,
            env={"PATH": f"{bin_}:/usr/bin:/bin", "DPKG_ROOT": str(tmp_path)},
        )  # fmt: skip
        return log.read_text(encoding="utf-8").splitlines()

    asked = configured()
    assert "groupadd --system ocmm" in asked
    assert any(line.startswith("useradd --system --gid ocmm") for line in asked)
    owned = asked.index(f"chown root:ocmm {acq}")
    # A change of the owner takes rights away.
    assert asked[owned + 1] == f"setcap cap_net_admin,cap_net_raw,cap_sys_nice=ep {acq}"
    assert acq.stat().st_mode & 0o777 == 0o750
    settings = tmp_path / "etc" / "ocmm" / "bus.env"
    settings.write_text("OCMM_INTERFACE=\n# mine\n", encoding="utf-8")
    configured()
    assert "# mine" in settings.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        ("upgrade 0.3.0-1 0.2.0-1", True),
        ("upgrade 0.2.0-1+git20261201.1a2b 0.2.0-1", True),
        ("upgrade 0.2.0-1 0.2.0-1~git20261128.1a2b", True),
        ("upgrade 0.1.0-1 0.2.0-1", False),
        ("upgrade 0.2.0-1 0.2.0-1", False),
        ("upgrade 0.2.0-1~git20261128.1a2b 0.2.0-1~git20261129.0a0b", False),
        ("install", False),
        # Removed before: this is the way that the message names.
        ("install 0.3.0-1 0.2.0-1", False),
    ],
)
def test_an_older_package_is_not_installed_over_a_newer_one(words: str, refused: bool) -> None:
    needs_tools("dpkg")
    done = subprocess.run(
        [str(_DEBIAN / "preinst"), *words.split()], capture_output=True, text=True, timeout=HANG_S,
        check=False,
    )  # fmt: skip
    assert done.returncode == int(refused), done.stderr
    assert ("remove" in done.stderr) is refused
    if refused:
        _, installed, older = words.split()
        assert f"version {installed} is installed and newer than {older}" in done.stderr


@pytest.mark.parametrize(
    ("words", "warned"),
    [
        ("upgrade 0.1.0-1", True),
        ("upgrade 0.2.0-1~git20261128.1a2b", True),
        ("upgrade 0.2.0-1", False),
        ("upgrade 0.3.0-1", False),
        ("remove", False),
    ],
)
def test_warns_before_a_package_that_cannot_refuse_to_be_older(
    tmp_path: Path, words: str, warned: bool
) -> None:
    needs_tools("dpkg")
    query = tmp_path / "dpkg-query"
    query.write_text("#!/bin/sh\nprintf 0.2.0-1\n", encoding="utf-8")
    query.chmod(0o755)
    done = subprocess.run(
        [str(_DEBIAN / "prerm"), *words.split()], check=True, timeout=HANG_S, capture_output=True,
        text=True, env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
    )  # fmt: skip
    assert ("is older than 0.2.0-1" in done.stderr) is warned
    assert ("settings stay" in done.stderr) is warned


def test_removing_touches_nothing_of_the_users(tmp_path: Path) -> None:
    for name in ("postrm", "prerm"):
        text = (_DEBIAN / name).read_text(encoding="utf-8")
        removed = re.findall(r"^\s*(?:rm|rmdir) .*$", text, re.M)
        assert all("/etc/ocmm" in line and "home" not in line for line in removed)
    kept = tmp_path / "home" / "user" / ".local" / "share" / "ocmm" / "keys" / "station.key"
    kept.parent.mkdir(parents=True)
    kept.write_text("key", encoding="utf-8")
    (tmp_path / "etc" / "ocmm").mkdir(parents=True)
    (tmp_path / "etc" / "ocmm" / "bus.env").write_text("OCMM_INTERFACE=\n", encoding="utf-8")
    done = subprocess.run(
        [str(_DEBIAN / "postrm"), "purge"], check=True, timeout=HANG_S, capture_output=True,
        text=True, env={"PATH": "/usr/bin:/bin", "DPKG_ROOT": str(tmp_path)},
    )  # fmt: skip
    assert not (tmp_path / "etc" / "ocmm").exists()
    assert kept.read_text(encoding="utf-8") == "key"
    assert "stay" in done.stderr
