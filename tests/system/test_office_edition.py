"""The office edition: everything except the camera bus, without POSIX; see `without_posix`."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import openpyxl
import pytest
from PySide6.QtGui import QImage

from benchmarks.house_tree import ROOTS
from ocmm_core.documents import resource
from tests.core.host.without_posix import MODULES, NAMES
from tests.host import HANG_S, on_linux_only
from tests.slow_rig import slow_rig_in

_ROOT = Path(__file__).resolve().parents[2]
_HIDING = _ROOT / "tests" / "core" / "host" / "without_posix.py"
# Packages for Linux alone, and their permitted names; other packages must not use them.
_LINUX_ROOMS = (
    "ocmm_core/host/", "ocmm_core/fieldbus/wire/", "ocmm_core/acquisition/bus_process/",
    "ocmm_sim/bus/", "ocmm_sim/slave/", "ocmm_bench/",
    "ocmm_core/doctor/", "ocmm_cli/station/_doctor", "ocmm_trackers/_link", "ocmm_genicam/_link",
)  # fmt: skip
_NEEDS_LINUX = (
    ("demo", "--headless", "--source", "ethercat:virtual"),
    ("bus", "scan", "--source", "ethercat:virtual"),
    ("selftest", "reliability"),
    ("station", "doctor", "--seconds", "0"),
)
_MARK = "=== the next command ends here ==="
# Behind the job and its reports, where all of it is loaded already.
_REFUSED_AND_IMPORTED = f"""
import importlib, pkgutil
for words in {_NEEDS_LINUX!r}:
    sys.stderr.write({_MARK!r})
    sys.stderr.write(str(run(*words)))
sys.stderr.write({_MARK!r})
count = 0
for root in {ROOTS!r}:
    package = importlib.import_module(root)
    for module in pkgutil.walk_packages(package.__path__, root + "."):
        if not module.name.endswith(("__main__", "host._posix")):
            importlib.import_module(module.name)
            count += 1
from ocmm_core.host import HOST
print()
print(type(HOST).__name__, count)
"""
_LEFT_OUT = re.compile(
    r'"(?:[a-z_]*uuid|[a-z_]*utc|head|key|line|sha256|software_version|seconds)": "[^"]*"'
)
# Times, identities, hashes and the codes that are made of them, as texts and cells show them.
_OF_THIS_RUN = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d[\d:.+Z]*|\d\d\.\d\d\.\d{4}/[\d:]+|\b\d\d:\d\d:\d\d\b"
    r"|\b[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}\b|\b[0-9a-f]{64}\b|\b[0-9a-f]{4}(?:-[0-9a-f]{4}){3}\b"
    # The number of a report, and the head of the chain in short.
    r"|-[0-9a-f]{8}-\d+\b|\b[0-9a-f]{16}\b"
)
_MEASURED_AND_REPORTED = """
import sys
from pathlib import Path
from ocmm_cli import main
plan, rig, out, words = sys.argv[1:]
def run(*arguments):
    sys.argv = ["ocmm", *arguments]
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0
assert not run("measure", "--plan", plan, "--rig", rig, "--out", out, "--seed", "3",
    "--serial", "1", "--operator", "Ada", "--speed", "0")
(job,) = Path(out).glob("*.ocmm")
assert not run("report", str(job), "--format", "all", "--out", out)
from PySide6.QtWidgets import QApplication
app = QApplication([])
from ocmm_core.export.report import report_of_job
from ocmm_core.inspection.finished import reopen_job
from tests.gui.pdf_texts import pages
drawn = pages(report_of_job(reopen_job(job)))
Path(words).write_text("\\n".join(drawn), "utf-8")
"""


def _environment(folder: Path, *, without: bool) -> dict[str, str]:
    home = folder / "home"
    home.mkdir(parents=True, exist_ok=True)
    path = [str(_ROOT)]
    if without:
        (folder / "hiding").mkdir(exist_ok=True)
        shutil.copyfile(_HIDING, folder / "hiding" / "sitecustomize.py")
        path.insert(0, str(folder / "hiding"))
    (folder / "temporary").mkdir(exist_ok=True)
    return {
        **os.environ,
        # Windows locks folders otherwise: such a program clears those that programs of Linux hold.
        "TMPDIR": str(folder / "temporary"),
        "HOME": str(home), "XDG_DATA_HOME": str(home), "XDG_STATE_HOME": str(home),
        "PYTHONPATH": os.pathsep.join(path), "QT_QPA_PLATFORM": "offscreen",
    }  # fmt: skip


def _run(
    folder: Path, *arguments: object, without: bool = True
) -> subprocess.CompletedProcess[str]:
    folder.mkdir(parents=True, exist_ok=True)
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=_environment(folder, without=without),
        cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip


@dataclass(frozen=True)
class Office:
    """Output and files of a process of the office edition, and a job of this system."""

    files: dict[str, str]
    linux_files: dict[str, str]
    refusals: dict[tuple[str, ...], tuple[int, str]]
    host: str
    modules: int


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Office:
    """Measure and report with both; without POSIX, also call Linux functions, import all."""
    base = tmp_path_factory.mktemp("office")
    rig = slow_rig_in(base)
    made: list[dict[str, str]] = []
    for without in (False, True):
        folder = base / f"{without}"
        # The words of a PDF are numbers of glyphs; its drawing instructions are comparable.
        done = _run(
            folder, "-c", _MEASURED_AND_REPORTED + _REFUSED_AND_IMPORTED * without,
            resource("plans", "quick.toml"), rig, folder / "out", folder / "out" / "pdf.txt",
            without=without,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        made.append({path.name: _steady(path) for path in sorted((folder / "out").iterdir())})
    _, *said, _ = done.stderr.split(_MARK)
    refusals = {}
    for words, text in zip(_NEEDS_LINUX, said, strict=True):
        # The code follows the text of the command.
        refusals[words] = int(text[-1]), text[:-1]
    host, count = done.stdout.split()[-2:]
    return Office(made[1], made[0], refusals, host, int(count))


@on_linux_only
def test_every_module_is_imported(office: Office) -> None:
    assert office.host == "WindowsHost"
    assert office.modules > 600


@on_linux_only
def test_a_job_and_its_reports_are_those_of_linux(office: Office) -> None:
    linux, other = office.linux_files, office.files
    assert other.keys() == linux.keys()
    assert len(linux) > 10
    assert {name for name in linux if linux[name] != other[name]} == set()


def _steady(path: Path) -> str:
    """Return the content of a file without times, names of this run, hashes and signatures."""
    if path.name.endswith((".seal.json", ".ocmm", ".pdf")):
        # Hashes and signatures, a data base that is full of times, and glyphs; see the caller.
        return ""
    if path.suffix == ".parquet":
        # Only where pyarrow is installed, so that it is read in here.
        from pyarrow.parquet import read_table

        return str(read_table(path).drop_columns(["TakenUtc"]).to_pydict())
    if path.suffix == ".xlsx":
        text = _cells(path)
    else:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
    if path.suffix == ".json":
        json.loads(text)
        text = _OF_THIS_RUN.sub("-", _LEFT_OUT.sub("", text))
    elif path.suffix in (".xlsx", ".qif", ".dfq", ".txt") or path.name.endswith("_job.csv"):
        text, count = _OF_THIS_RUN.subn("-", text)
        # The form of a first article has no time.
        assert count < 60, path.name
        assert count or path.name.endswith("_fai.xlsx"), path.name
    return text


def _cells(path: Path) -> str:
    book = openpyxl.load_workbook(path)
    return "\n".join(
        f"{sheet.title}!{cell.coordinate} {cell.value!r}"
        for sheet in book
        for row in sheet.iter_rows()
        for cell in row
        if cell.value is not None
    )


@on_linux_only
def test_the_window_measures(tmp_path: Path) -> None:
    picture = tmp_path / "window.png"
    done = _run(
        tmp_path / "run", "-m", "ocmm_gui", "--plan", resource("plans", "quick.toml"),
        "--rig", slow_rig_in(tmp_path), "--speed", "0", "--silent", "--size", "1280x720",
        "--out", tmp_path / "out",
        "--quit-after", "4", "--screenshot", picture,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert QImage(str(picture)).width() == 1280
    assert list((tmp_path / "out").glob("*.ocmm"))


@on_linux_only
@pytest.mark.parametrize("arguments", _NEEDS_LINUX, ids=" ".join)
def test_what_needs_linux_says_so(office: Office, arguments: tuple[str, ...]) -> None:
    code, said = office.refusals[arguments]
    assert code == 2, said
    assert "needs Linux; this computer runs another system." in " ".join(said.split())
    assert "Traceback" not in said


_MAY_USE = re.compile(
    "|".join(
        [rf"\b(?:{'|'.join(MODULES)})\b", rf"from (?:{'|'.join(NAMES)}) import"]
        + [rf"\b{module}\.(?:{names.replace(' ', '|')})\b" for module, names in NAMES.items()]
    )
)
"""Words of a file that may use one of them: parsing every file takes seconds."""


def _uses(path: Path) -> Iterator[str]:
    text = path.read_text("utf-8")
    if _MAY_USE.search(text) is None:
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module in MODULES:
            yield node.module
        elif isinstance(node, ast.ImportFrom) and node.module in NAMES:
            hidden = NAMES[node.module].split()
            yield from (f"{node.module}.{n.name}" for n in node.names if n.name in hidden)
        elif (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.attr in NAMES.get(node.value.id, "").split()
        ):
            yield f"{node.value.id}.{node.attr}"


def test_no_other_room_names_what_only_posix_has() -> None:
    found = {
        f"{path.relative_to(_ROOT)}: {use}"
        for root in ROOTS
        for path in (_ROOT / root).rglob("*.py")
        if not str(path.relative_to(_ROOT)).startswith(_LINUX_ROOMS)
        for use in _uses(path)
    }
    assert found == set()


def test_a_use_would_be_found(tmp_path: Path) -> None:
    source = tmp_path / "a.py"
    source.write_text("import fcntl\nfrom os import fork\nimport os\nos.getuid()\nos.getpid()\n")
    assert sorted(_uses(source)) == ["fcntl", "os.fork", "os.getuid"]
